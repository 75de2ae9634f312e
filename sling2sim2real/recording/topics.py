"""Which topic plays which role: by params, else by type, rate, and words in the name.

Where two topics would do as well, params must say which is meant: what moves together, and which of
two arms pulled the band, is not guessed.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import images
from sling2sim2real.recording.camera import Camera, camera_from
from sling2sim2real.recording.files import Container
from sling2sim2real.recording.kinematics import chain_of
from sling2sim2real.recording.messages import TYPES, Edge, Reading, Topic, Unreadable
from sling2sim2real.recording.transforms import Transform, TransformTree, is_tool
from sling2sim2real.recording.words import few
from sling2sim2real.settings.lab import SetupParams

TRIES = 9  # messages that are looked at to know a topic
JOINT_TRIES = 50  # of joints and transforms: some share their topic with other publishers
SHOWN = 12  # topics or joints named in a message
FINGERS = ("finger", "gripper", "knuckle")
MOVES = 0.3  # of the largest movement: joints that move less are no fingers, or another hand's
ALIKE = 0.9  # correlation of fingers that move as one
OPTIONAL = ("gripper",)
COMMANDS = ("goal", "desired", "command", "commanded", "cmd", "target", "reference", "setpoint")
THINGS = ("camera", "object", "tag", "marker")
STILL = 1e-9  # m and quaternion: a transform that changes by more is no static one

Convert = Callable[[np.ndarray], np.ndarray]
Messages = Sequence[tuple[int, Reading | Unreadable]]


@dataclass(frozen=True)
class Choice:
    """A topic, what it says, and why it was chosen.

    Attributes:
        topic: The whole of it.
        messages: log_time of each [ns], and its reading or why it cannot be read.
        why: One phrase.
        size: Width and height of its pictures.
        convert: All values, shape (S, C), to what the role asks for, shape (S, 7) or (S, 1); None
            where the values are that already. Raises UserError.
    """

    topic: Topic
    messages: Messages
    why: str = ""
    size: tuple[int, int] = (0, 0)
    convert: Convert | None = None

    @property
    def name(self) -> str:
        return self.topic.name

    @property
    def readings(self) -> list[Reading]:
        """Those of its messages that can be read."""
        return [reading for _, reading in self.messages if isinstance(reading, Reading)]

    @property
    def typical(self) -> Reading:
        """The one in the middle, for what all have in common. Raises UserError if there is none."""
        readings = self.readings
        if not readings:
            reason = next((why for _, why in self.messages[::-1]), "all are damaged")
            raise UserError(f"{self.name} has fewer than two readable messages ({reason})")
        return readings[len(readings) // 2]


@dataclass(frozen=True)
class Role:
    """What a topic must be, and words in its name that speak for (+) or against (-) it.

    Attributes:
        what: It, in messages.
        shows: What its messages must show (`TYPES`), one of these.
        rate: Below it, a topic of the right type is not likely to be it [Hz].
        spare: Types that serve only where there is no other.
    """

    what: str
    shows: tuple[str, ...]
    hints: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    rate: float = 0.0
    spare: tuple[str, ...] = ()

    @property
    def types(self) -> list[str]:
        """The best first."""
        return [kind for kind, shows in TYPES.items() if {*shows} & {*self.shows}]


CAMERAS = ("color", "depth")  # roles of pictures
ROLES = {
    "wrench": Role(
        "force (a geometry_msgs/WrenchStamped topic)",
        ("wrench",),
        hints=("ft", "force", "wrench"),
        doubts=(*COMMANDS, "estimated", "external", "filtered", "compensated"),
        rate=50,
        spare=("FrankaRobotState", "FrankaState"),  # an estimate from the motors' torques
    ),
    "pose": Role(
        "end-effector pose (a geometry_msgs/PoseStamped topic)",
        ("pose", "joints", "transforms"),
        hints=("current", "ee", "eef", "tcp", "end_effector", "measured"),
        doubts=(*COMMANDS, *THINGS),
        rate=10,
        spare=("Odometry", "PosesInFrame", "TFMessage", "FrameTransform", "FrameTransforms"),
    ),
    "gripper": Role(
        "gripper (a sensor_msgs/JointState topic)",
        ("joints",),
        hints=("gripper", "finger", "hand"),
        doubts=COMMANDS,
    ),
    "color": Role(
        "colour images (a sensor_msgs/Image or CompressedImage topic)",
        ("picture",),
        hints=("color", "colour", "rgb"),
        doubts=("infra", "ir", "left", "right", "depth", "mask", "debug"),
    ),
    "depth": Role(
        "depth images (16UC1 or 32FC1, raw or compressedDepth)",
        ("picture",),
        hints=("aligned", "registered", "depth"),
        doubts=("mask", "debug"),
    ),
    "color_info": Role("camera info of the colour images", ("info",)),
    "depth_info": Role("camera info of the depth images", ("info",)),
}


def _words(name: str) -> set[str]:
    return {*re.findall("[a-z]+", name.lower())}  # infra1 is infra


def _rate(topic: Topic) -> float:
    """Messages a second, by when they were logged."""
    span = (max(topic.log_times) - min(topic.log_times)) * 1e-9
    return (len(topic.log_times) - 1) / span if span > 0 else 0.0


def _standing(role: Role, topic: Topic) -> tuple:
    """What decides: measured, not spare, no doubts, a likely rate, type, a hint in the name."""
    words = _words(topic.name)
    doubts = words & {*role.doubts}
    return (
        not doubts & {*COMMANDS},
        topic.kind not in role.spare,
        -len(doubts),
        _rate(topic) >= role.rate,
        -role.types.index(topic.kind),
        _hinted(role, topic),
    )


def choose(
    container: Container, setup: SetupParams, still: TransformTree | None = None
) -> dict[str, Choice]:
    """Role to topic, for every role of ROLES that the file has.

    Args:
        container: What was read.
        setup: params.setup: topics (a topic's name for a role, or None), urdf, tip_link.
        still: Transforms that do not move; None reads them.

    Raises:
        UserError: for a role that nothing can play, with what the file has and how to mend it; or
            for those that several topics could play, with the settings that decide.
    """
    chooser = _Chooser(container, setup, still or transforms_of(container))
    chosen: dict[str, Choice] = {}
    for role in ROLES:
        choice = chooser.choice(role, chosen)
        if choice is not None:
            chosen[role] = choice
        elif role not in OPTIONAL or getattr(setup.topics, role):
            raise chooser.lacking(role)
    if chooser.ambiguous:
        raise UserError(
            f"several topics would do: {'; '.join(chooser.ambiguous)}: name those that are meant in"
            " params.yaml"
        )
    return chosen


def camera_of(chosen: dict[str, Choice], role: str) -> Camera:
    """The camera of the images of `role`, color or depth. Raises UserError."""
    info, image = chosen[f"{role}_info"], chosen[role]
    return camera_from(info.name, info.typical.value, image.name, image.size)


class _Chooser:
    """Goes through the topics of one file, role by role."""

    def __init__(self, container: Container, setup: SetupParams, still: TransformTree) -> None:
        self.topics, self.setup, self.still = container.topics, setup, still
        self.problems: list[str] = []  # why topics of the right type could not be used
        self.ambiguous: list[str] = []  # settings of roles that several topics could play

    def choice(self, role: str, chosen: dict[str, Choice]) -> Choice | None:
        self.problems, name = [], getattr(self.setup.topics, role)
        hinted = sorted(self.topics, key=lambda topic: not _hinted(ROLES[role], topic))
        fitting = [
            choice
            for topic in hinted
            if name in (None, topic.name) and (choice := self._read(role, topic, name is not None))
        ]
        if name is not None:
            most = max(fitting, key=lambda choice: len(choice.messages), default=None)
            return most and replace(most, why=f"setup.topics.{role}")
        if role.endswith("_info"):
            return self._info(fitting, role.removesuffix("_info"), chosen)
        if role == "depth" and (frame := chosen["color"].typical.frame):  # registered to colour
            fitting = [choice for choice in fitting if choice.typical.frame == frame] or fitting
        if not fitting:
            return None
        best = max(fitting, key=lambda c: (_standing(ROLES[role], c.topic), len(c.messages)))
        standing = _standing(ROLES[role], best.topic)
        alike = {_source(c.name) for c in fitting if _standing(ROLES[role], c.topic) == standing}
        if len(alike) > 1:
            self.ambiguous.append(f"setup.topics.{role} {few(sorted(alike), SHOWN)}")
        return replace(best, why=_why(ROLES[role], best, fitting))

    def lacking(self, role: str) -> UserError:
        """That nothing, or not what was named, can play the role that was asked for last."""
        name = getattr(self.setup.topics, role)
        what = f"setup.topics.{role} is {name}" if name else f"no {ROLES[role].what}"
        has = sorted({f"{topic.name} ({topic.kind or _type(topic)})" for topic in self.topics})
        why = "; or ".join(self.problems[:2]) or (
            f"the file has {few(has, SHOWN) or 'no messages at all'}, and there none of a type that"
            f" is read for it ({', '.join(ROLES[role].types)}): record one"
        )
        return UserError(f"{what}; {why}")

    def _read(self, role: str, topic: Topic, named: bool) -> Choice | None:
        """What a topic says for a role; None, with a word in `problems`, where it is of no use."""
        what = {*ROLES[role].shows} & {*topic.readings}
        if not what:
            return None
        try:
            if topic.problem:
                raise UserError(topic.problem)
            if role in CAMERAS:
                choice = _pictures(role, topic)
            elif role == "gripper":
                choice = _gripper(topic, named)
            elif what == {"joints"}:
                choice = _arm(topic, self.setup)
            elif what == {"transforms"}:
                choice = None if _is_static(topic) else _hand(topic, self.setup, self.still)
            else:
                choice = Choice(topic, _all(topic, *what))
            return choice if choice and choice.typical else None
        except UserError as error:
            self.problems.append(str(error))
            return None

    def _info(self, infos: Sequence[Choice], role: str, chosen: dict[str, Choice]) -> Choice | None:
        """A camera info belongs to the images in whose folder it is, or with their frame and size.

        Depth may take the colour camera's where it is registered to colour: in its frame and size.
        """
        image, color = chosen[role], chosen["color"]
        frame, fitting = image.typical.frame, []
        for info in infos:
            camera = info.typical.value.camera
            own = _beside(info.name, image.name)
            own &= role == "color" or not _beside(info.name, color.name)
            alike = 0 < len(frame) and camera.frame == frame
            alike &= image.size == (camera.width, camera.height)
            if own or alike:
                fitting.append((own, alike, len(info.messages), info))
            else:
                self.problems.append(
                    f"{info.name} is of frame {camera.frame!r}, {camera.width} x {camera.height}"
                    f" pixels, {image.name} of {frame!r}, {image.size[0]} x {image.size[1]}: record"
                    f" the camera info of those images, or name it in setup.topics.{role}_info"
                )
        if not fitting:
            return None
        own, _, _, best = max(fitting, key=lambda entry: entry[:3])
        return replace(best, why=f"{'beside' if own else 'of the frame and size of'} {image.name}")


def _hinted(role: Role, topic: Topic) -> bool:
    words = _words(topic.name)
    return any(h in words or (len(h) > 3 and h in topic.name.lower()) for h in role.hints)


def _type(topic: Topic) -> str:
    return topic.schema.name or f"{topic.encoding} topic without a schema"


def _all(topic: Topic, what: str) -> Messages:
    return list(zip(topic.log_times, topic.readings[what], strict=True))


def _mapped(topic: Topic, what: str, read: Callable[[Reading], Reading | None]) -> Messages:
    """What `read` makes of each reading: None, of a message of another publisher, is left out."""
    messages = []
    for time, reading in _all(topic, what):
        if isinstance(reading, Reading):
            try:
                reading = read(reading)
            except ValueError as error:
                reading = Unreadable.by(error)
        if reading is not None:
            messages.append((time, reading))
    return messages


def _joints(topic: Topic, names: tuple[str, ...], frame: str | None = None) -> Messages:
    """Positions of these joints, in this order, of the messages that have any of them."""

    def read(reading: Reading) -> Reading | None:
        missing = [name for name in names if name not in reading.value]
        if len(missing) == len(names):
            return None
        if missing:
            raise ValueError(f"joint {missing[0]} is missing")
        values = tuple(reading.value[name] for name in names)
        return Reading(reading.stamp, reading.frame if frame is None else frame, values)

    return _mapped(topic, "joints", read)


def _joint_names(topic: Topic) -> list[str]:
    """Joints in the first messages, of all who publish. Raises UserError if there are none."""
    some = Choice(topic, _all(topic, "joints")).readings[:JOINT_TRIES]
    names = [*dict.fromkeys(name for reading in some for name in reading.value)]
    if not names:
        raise UserError(f"{topic.name} has fewer than two readable messages (no positions)")
    return names


def _pictures(role: str, topic: Topic) -> Choice:
    """Pictures of which one of some can be decoded to what the role asks for. Raises UserError."""
    choice, reasons = Choice(topic, _all(topic, "picture")), []
    pictures = choice.readings
    for k in np.unique(np.linspace(0, len(pictures) - 1, TRIES).astype(int)) if pictures else ():
        try:
            height, width = getattr(images, role)(pictures[k].value).shape[:2]
        except images.Undecodable as error:
            reasons.append(str(error))
        else:
            return replace(choice, size=(width, height))
    if not reasons:
        return choice  # without a readable message
    raise UserError(f"{topic.name}: its pictures cannot be decoded: {reasons[0]}")


def _gripper(topic: Topic, named: bool) -> Choice | None:
    """The joints of a gripper, not of an arm; all joints where params name the topic."""
    names = _joint_names(topic)
    fingers = [name for name in names if _is_finger(name)]
    if not fingers and not named and not _is_finger(topic.name):
        return None
    moving = tuple(fingers or names)
    convert = partial(opening_of, topic=topic.name, names=moving)
    return Choice(topic, _joints(topic, moving), convert=convert)


def opening_of(values: np.ndarray, topic: str, names: tuple[str, ...]) -> np.ndarray:
    """Opening of a hand, shape (S, 1), from the positions of its fingers (S, C).

    Fingers of a mirrored sign count the other way round, those that hardly move not at all. Raises
    UserError where the others do not move as one, as those of two hands.
    """
    moved = np.ptp(values, axis=0)
    counts = moved >= MOVES * moved.max()
    fingers = values[:, counts]
    if moved.max() == 0:
        return fingers.sum(axis=1, keepdims=True)
    likeness = np.corrcoef(fingers.T, values[:, np.argmax(moved)])[-1, :-1]
    if np.abs(likeness).min() < ALIKE:
        moving = ", ".join(name for name, counted in zip(names, counts, strict=True) if counted)
        raise UserError(f"{topic}: the joints {moving} do not move as the fingers of one hand")
    return (fingers * np.sign(likeness)).sum(axis=1, keepdims=True)


def _arm(topic: Topic, setup: SetupParams) -> Choice:
    """Joint states through params' URDF."""
    names = [name for name in _joint_names(topic) if not _is_finger(name)]
    has = few(names, SHOWN) or "of fingers alone"
    if setup.urdf is None:
        raise UserError(
            f"{topic.name} has the joints {has}: put the robot's URDF into robots/ and name it in"
            " setup.urdf"
        )
    chain = chain_of(setup.urdf, setup.tip_link)
    if lacks := [name for name in chain.names if name not in names]:
        raise UserError(
            f"{topic.name} lacks joint {few(lacks, SHOWN)} of {setup.urdf}, it has {has}: check"
            " setup.urdf and setup.tip_link"
        )
    return Choice(topic, _joints(topic, chain.names, chain.root), convert=chain.poses)


def _is_finger(name: str) -> bool:
    return any(word in name.lower() for word in FINGERS)


def _hand(topic: Topic, setup: SetupParams, still: TransformTree) -> Choice:
    """The hand's pose from transforms that are published all the time.

    The hand is setup.tip_link, or the one frame named like a tool; its pose is given in the frame
    from which on up nothing moves. Each message must hold all that moves between the two.

    Raises UserError where no such frame moves.
    """
    some = Choice(topic, _all(topic, "transforms")).readings[:JOINT_TRIES]
    moving = {child: parent for reading in some for parent, child in reading.value}
    parents = still.parents | moving
    tools = filter(is_tool, parents)
    chains = []
    for tip in [setup.tip_link] if setup.tip_link in parents else sorted(tools):
        up = [tip]
        while up[-1] in parents and len(up) <= len(parents):
            up.append(parents[up[-1]])
        last = max((k for k, name in enumerate(up) if name in moving), default=-1)
        if last >= 0:
            chains.append(up[: last + 2])
    if len(chains) != 1:
        raise UserError(
            f"{topic.name} moves {few(sorted(moving), SHOWN)}: name the frame of the tool centre"
            " point in setup.tip_link"
        )
    (up,) = chains
    fixed = {child: still.between(parent, child) for child, parent in zip(up, up[1:], strict=False)}

    def read(reading: Reading) -> Reading | None:
        seen = {child: Transform.of(pose) for (_, child), pose in reading.value.items()}
        if not {*moving} & {*up} & {*seen}:
            return None
        pose = Transform.identity()
        for child in up[:-1]:
            step = seen.get(child) or (None if child in moving else fixed[child])
            if step is None:
                raise ValueError(f"the transform of {child} is missing")
            pose = step @ pose
        return Reading(reading.stamp, up[-1], tuple(pose.pose()))

    return Choice(topic, _mapped(topic, "transforms", read))


def _source(topic: str) -> str:
    """A topic's name without that of the transport, by which one picture is sent several times."""
    return topic.removesuffix("/compressed").removesuffix("/compressedDepth")


def _beside(info: str, image: str) -> bool:
    """Whether the two are in one folder, the name of the image's transport left out."""
    folder, parts = info.split("/")[:-1], image.split("/")
    return any(folder) and folder in (parts[:-1], parts[:-2])


def _why(role: Role, best: Choice, fitting: list[Choice]) -> str:
    others = sorted({choice.name for choice in fitting} - {best.name})
    if not others:
        return f"the only {best.topic.kind} for {role.what.partition(' (')[0]}"
    return f"at {_rate(best.topic):.0f} Hz; not {few(others, 2)}"


def transforms_of(container: Container) -> TransformTree:
    """All of tf_static; of /tf and of Foxglove's transforms those that keep still.

    Messages that cannot be read are left out: a transform that is missed is asked for later.
    """
    poses: dict[Edge, np.ndarray] = {}
    parents: dict[str, str] = {}
    moving: set[Edge] = set()
    tree = TransformTree()
    for topic in container.topics:
        static = _is_static(topic)
        for reading in topic.readings.get("transforms", []):
            edges: Mapping[Edge, np.ndarray] = getattr(reading, "value", {})
            for edge, pose in edges.items():
                parent, child = edge
                changes = np.abs(poses.get(edge, pose) - pose).max() > STILL
                if static and (changes or parents.get(child, parent) != parent):
                    tree.doubled.add(child)
                elif changes:
                    moving.add(edge)
                poses[edge], parents[child] = pose, parent
    for edge, pose in poses.items():
        if edge not in moving:
            tree.add(*edge, Transform.of(pose))
    return tree


def _is_static(topic: Topic) -> bool:
    return topic.name.rsplit("/", 1)[-1] == "tf_static"
