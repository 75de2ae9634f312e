"""Which topic plays which role: by params, else by type, rate, and words in the name.

Where two topics would do as well, params must say which is meant: what moves together, and which of
two arms pulled the band, is not guessed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from os.path import commonprefix

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import images
from sling2sim2real.recording.camera import Camera, camera_from
from sling2sim2real.recording.files import Container
from sling2sim2real.recording.kinematics import chain_of
from sling2sim2real.recording.messages import (
    READERS,
    TRANSFORMS,
    TRIES,
    Channel,
    Decoder,
    Edge,
    Elsewhere,
    Message,
    Read,
    Reading,
    Unreadable,
    decoder,
    edges_of,
    fingers_reader,
    joints_of,
    joints_reader,
    kind_of,
    message_reader,
    opening_of,
    readable,
    stamp_of,
)
from sling2sim2real.recording.transforms import Transform, TransformTree
from sling2sim2real.recording.words import few
from sling2sim2real.settings.lab import SetupParams

JOINT_TRIES = 50  # of joints: some share their topic with other publishers
JOINTS_SHOWN = 12  # joints named in a message
FINGERS = ("finger", "gripper", "knuckle")
OPTIONAL = ("gripper",)
COMMANDS = ("goal", "desired", "command", "commanded", "cmd", "target", "reference", "setpoint")
THINGS = ("camera", "object", "tag", "marker")

STATES = ("FrankaRobotState", "FrankaState")
SHOWN = 12  # topics named in a message
COLOUR = {"color": "colour", "depth": "depth"}
VIDEO = ("FFMPEGPacket", "CompressedVideo")
TOOLS = ("tcp", "ee", "end_effector")  # words in the name of the frame that a pose is given for
STILL = 1e-9  # m and quaternion: a transform that changes by more is no static one

Convert = Callable[[np.ndarray], np.ndarray]
Source = tuple[Read, Convert | None]


@dataclass(frozen=True)
class Choice:
    """A channel, how to read it, and why it was chosen.

    Attributes:
        channel: Raw payloads.
        read: Payload to reading; raises Unreadable.
        why: One phrase.
        convert: All values, shape (S, C), to what the role asks for, shape (S, 7) or (S, 1); None
            where the values are that already. Raises UserError.
    """

    channel: Channel
    read: Callable[[bytes], Reading]
    why: str = ""
    convert: Convert | None = None

    def typical(self) -> Reading:
        """The first message of the frame and kind that most have. Raises UserError."""
        messages, reason = readable(self.read, self.channel.payloads)
        if not messages:
            raise UserError(f"{self.channel.topic} has fewer than two readable messages ({reason})")
        kinds = [(message.frame, getattr(message.value, "kind", None)) for message in messages]
        return messages[kinds.index(Counter(kinds).most_common(1)[0][0])]


@dataclass(frozen=True)
class Role:
    """What a topic must be, and words in its name that speak for (+) or against (-) it.

    Attributes:
        what: It, in messages.
        rate: Below it, a topic of the right type is not likely to be it [Hz].
        spare: Types that serve only where there is no other.
    """

    what: str
    hints: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    rate: float = 0.0
    spare: tuple[str, ...] = ()


CAMERAS = ("color", "depth")  # roles of pictures
ROLES = {
    "wrench": Role(
        "force (a geometry_msgs/WrenchStamped topic)",
        hints=("ft", "force", "wrench"),
        doubts=(*COMMANDS, "estimated", "external", "filtered", "compensated"),
        rate=50,
        spare=STATES,  # they estimate the force from the motors' torques
    ),
    "pose": Role(
        "end-effector pose (a geometry_msgs/PoseStamped topic)",
        hints=("current", "ee", "eef", "tcp", "end_effector", "measured"),
        doubts=(*COMMANDS, *THINGS),
        rate=10,
        spare=("Odometry", "PosesInFrame", *TRANSFORMS),
    ),
    "gripper": Role(
        "gripper (a sensor_msgs/JointState topic)",
        hints=("gripper", "finger", "hand"),
        doubts=COMMANDS,
    ),
    "color": Role(
        "colour images (a sensor_msgs/Image or CompressedImage topic)",
        hints=("color", "colour", "rgb"),
        doubts=("infra", "ir", "left", "right", "depth", "mask", "debug"),
    ),
    "depth": Role(
        "depth images (16UC1 or 32FC1, raw or compressedDepth)",
        hints=("aligned", "registered", "depth"),
        doubts=("mask", "debug"),
    ),
    "color_info": Role("camera info of the colour images"),
    "depth_info": Role("camera info of the depth images"),
}


@dataclass(frozen=True)
class Candidate:
    """A channel that could play a role."""

    role: Role
    readers: Mapping[str, Read | None]
    choice: Choice
    typical: Reading

    @property
    def topic(self) -> str:
        return self.choice.channel.topic

    @property
    def kind(self) -> str:
        return kind_of(self.choice.channel.schema.name)

    @property
    def rate(self) -> float:
        """Messages a second, by when they were logged."""
        times = self.choice.channel.log_times
        span = (max(times) - min(times)) * 1e-9
        return (len(times) - 1) / span if span > 0 else 0.0

    @property
    def hints(self) -> list[str]:
        """The role's hints in the topic's name: whole words, or long ones within words."""
        name = self.topic.lower()
        return [h for h in self.role.hints if h in self._words or (len(h) > 3 and h in name)]

    @property
    def doubts(self) -> list[str]:
        return [doubt for doubt in self.role.doubts if doubt in self._words]

    @property
    def _words(self) -> list[str]:
        return re.findall("[a-z]+", self.topic.lower())  # infra1 is infra

    def standing(self) -> tuple:
        """What decides: measured, not spare, no doubts, a likely rate, kind, whether hints."""
        return (
            not set(self.doubts) & set(COMMANDS),
            self.kind not in self.role.spare,
            -len(self.doubts),
            self.rate >= self.role.rate,
            -list(self.readers).index(self.kind),
            bool(self.hints),
        )

    def merit(self) -> tuple:
        """The standing; among topics of one standing number of messages, and the alphabet."""
        count = len(self.choice.channel.payloads)
        return *self.standing(), count, [-ord(c) for c in self.topic]


def source_of(
    role: str,
    channel: Channel,
    decode: Decoder,
    setup: SetupParams,
    still: TransformTree,
    named: bool,
) -> Source | None:
    """How to read a channel for a role, and how to convert what was read.

    None where it is of the right type, but something else, which is no news to anybody.

    Args:
        role: One of ROLES; the channel's schema is among those of its readers.
        channel, decode: The topic.
        still: What does not move.
        named: Whether params name the topic.

    Raises:
        UserError: where it would be if params said more, or if it could be read.
    """
    kind = kind_of(channel.schema.name)
    if role == "gripper":
        return _gripper(channel, decode, named)
    if role == "pose" and kind in READERS["gripper"]:
        return _arm(channel, decode, setup)
    if role == "pose" and kind in TRANSFORMS:
        if _is_static(channel):
            return None
        return _hand_of(channel, decode, setup, still), None
    read = READERS[role][kind]
    return read and (read, None)


def _hand_of(channel: Channel, decode: Decoder, setup: SetupParams, still: TransformTree) -> Read:
    """How to read the hand's pose from transforms that are published all the time.

    The hand is setup.tip_link, or the one frame named like a tool; its pose is given in the frame
    from which on up nothing moves. Each message must hold all that moves between the two.

    Raises UserError where no such frame moves.
    """
    some, _ = readable(message_reader(decode, edges_of), channel.payloads, JOINT_TRIES)
    parents = {child: parent for parent, child in {edge for edge, _ in chain.from_iterable(some)}}
    moving = {*parents}
    parents |= {child: parent for child, parent in still.parents.items() if child not in parents}
    tools = [name for name in parents if set(name.lower().split("_")) & {*TOOLS}]
    tips = [setup.tip_link] if setup.tip_link in parents else sorted(tools)
    chains = []
    for frame in tips:
        up = [frame]
        while up[-1] in parents and len(up) <= len(parents):
            up.append(parents[up[-1]])
        last = max((k for k, name in enumerate(up) if name in moving), default=-1)
        if last >= 0:
            chains.append(up[: last + 2])
    if len(chains) != 1:
        raise UserError(
            f"{channel.topic} moves {few(sorted(moving), SHOWN)}: name the frame of the tool centre"
            " point in setup.tip_link"
        )
    (up,) = chains
    fixed = {child: still.between(parent, child) for child, parent in zip(up, up[1:], strict=False)}

    def read(message: Message) -> Reading:
        seen = {child: Transform.of(pose) for (_, child), pose in edges_of(message)}
        if not moving & {*up} & {*seen}:
            raise Elsewhere("other frames")
        pose = Transform.identity()
        for child in up[:-1]:
            step = seen.get(child) or (None if child in moving else fixed[child])
            if step is None:
                raise ValueError(f"the transform of {child} is missing")
            pose = step @ pose
        stamped = getattr(message, "transforms", [message])[0]
        return Reading(stamp_of(stamped), up[-1], tuple(pose.pose()))

    return read


def _gripper(channel: Channel, decode: Decoder, named: bool) -> Source | None:
    """The joints of a gripper, not of an arm; all joints where params name the topic."""
    by_topic = named or _has(FINGERS, channel.topic)
    for names in _joint_names(channel, decode):
        fingers = tuple(name for name in names if _has(FINGERS, name))
        if fingers or by_topic:
            only = tuple(name for name in fingers if "finger" in name.lower())
            moving = only or fingers or names
            return fingers_reader(moving), partial(opening_of, topic=channel.topic, names=moving)
    return None


def _arm(channel: Channel, decode: Decoder, setup: SetupParams) -> Source | None:
    """Joint states through params' URDF."""
    joint_names = _joint_names(channel, decode)
    arms = [some for some in joint_names if not all(_has(FINGERS, name) for name in some)]
    if not arms:
        return None
    names = arms[0]
    has = ", ".join(names[:JOINTS_SHOWN])
    if setup.urdf is None:
        raise UserError(
            f"{channel.topic} has the joints {has}: put the robot's URDF into robots/ and name it"
            " in setup.urdf"
        )
    chain = chain_of(setup.urdf, setup.tip_link)
    if not any(set(chain.names) <= set(some) for some in joint_names):
        lacks = ", ".join([name for name in chain.names if name not in names][:JOINTS_SHOWN])
        raise UserError(
            f"{channel.topic} lacks joint {lacks} of {setup.urdf}, it has {has}: check setup.urdf"
            " and setup.tip_link"
        )
    return joints_reader(chain.names, chain.root), chain.poses


def _joint_names(channel: Channel, decode: Decoder) -> list[tuple[str, ...]]:
    """Names in the first messages, the most frequent first. Raises UserError if there are none."""
    read = message_reader(decode, lambda message: tuple(joints_of(message)))
    messages, _ = readable(read, islice(channel.payloads, JOINT_TRIES), None)
    names = [some for some, _ in Counter(messages).most_common() if some]
    if not names:
        raise UserError(f"{channel.topic} has fewer than two readable messages (no positions)")
    return names


def _has(words: tuple[str, ...], name: str) -> bool:
    return any(word in name.lower() for word in words)


def choose(
    container: Container, setup: SetupParams, still: TransformTree | None = None
) -> dict[str, Choice]:
    """Role to channel, for every role of ROLES that the file has.

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
        elif role not in OPTIONAL:
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
    calibration, topic = info.typical().value, image.channel.topic
    return camera_from(info.channel.topic, calibration, topic, _size(image))


class _Chooser:
    """Goes through the channels of one file, role by role."""

    def __init__(self, container: Container, setup: SetupParams, still: TransformTree) -> None:
        self.container, self.setup, self.still = container, setup, still
        self.problems: list[str] = []  # why channels of the right type could not be used
        self.ambiguous: list[str] = []  # settings of roles that several topics could play

    def choice(self, role: str, chosen: dict[str, Choice]) -> Choice | None:
        self.problems = []
        name = getattr(self.setup.topics, role)
        if name is not None:
            return self._named(role, name)
        fitting = [self._candidate(role, channel) for channel in self.container.channels]
        candidates = [topic for topic in fitting if topic is not None and self._suits(role, topic)]
        if role.endswith("_info"):
            return self._info(candidates, role.removesuffix("_info"), chosen)
        if not candidates:
            return None
        if role == "depth":
            candidates = _nearest(candidates, chosen["color"])
        best = max(candidates, key=Candidate.merit)
        alike = {_source(c.topic) for c in candidates if c.standing() == best.standing()}
        if len(alike) > 1:
            self.ambiguous.append(f"setup.topics.{role} {few(sorted(alike), SHOWN)}")
        return replace(best.choice, why=_why(best, candidates))

    def lacking(self, role: str) -> UserError:
        what = ROLES[role].what
        if role in CAMERAS:
            self.problems += [
                f"{c.topic} is video ({kind_of(_type(c))}): record images"
                for c in self.container.channels
                if kind_of(_type(c)) in VIDEO
            ]
        if self.problems:
            return UserError(f"no {what}; {'; or '.join(self.problems[:2])}")
        if not self.container.channels:
            return UserError(f"no {what}; the file has no messages at all: record it again")
        has = sorted({f"{c.topic} ({kind_of(_type(c))})" for c in self.container.channels})
        types = ", ".join(READERS[role])
        return UserError(
            f"no {what}; the file has {few(has, SHOWN)}, and none of a type that is read for it"
            f" ({types}): record one"
        )

    def _named(self, role: str, name: str) -> Choice:
        channels = [c for c in self.container.channels if c.topic == name]
        where = f"setup.topics.{role}"
        if not channels:
            has = ", ".join(sorted({c.topic for c in self.container.channels})[:SHOWN])
            raise UserError(f"{where}: no topic {name}, the file has {has or 'none'}")
        readers = READERS[role]
        fitting = [c for c in channels if kind_of(c.schema.name) in readers]
        if not fitting:
            types = " or ".join(readers)
            raise UserError(f"{where}: {name} is a {_type(channels[0])}, not {types}")
        candidate = self._candidate(role, max(fitting, key=lambda c: len(c.payloads)), named=True)
        if candidate is None:
            problem = (self.problems or [f"{name} has no messages, or fingers only"])[0]
            raise UserError(f"{where}: {problem}")
        if role in CAMERAS and (problem := undecodable(role, candidate.choice)):
            raise UserError(f"{where}: {name}: {problem}")
        return replace(candidate.choice, why=f"setup.topics.{role}")

    def _candidate(self, role: str, channel: Channel, named: bool = False) -> Candidate | None:
        """None, with a word in `problems`, for a channel of the right type that is of no use."""
        if kind_of(channel.schema.name) not in READERS[role] or not channel.payloads:
            return None
        try:
            decode = decoder(channel)
            source = source_of(role, channel, decode, self.setup, self.still, named)
            if source is None:
                return None
            read, convert = source
            choice = Choice(channel, message_reader(decode, read), "", convert)
            return Candidate(ROLES[role], READERS[role], choice, choice.typical())
        except UserError as error:
            self.problems.append(str(error))
            return None

    def _suits(self, role: str, candidate: Candidate) -> bool:
        """Pictures: whether they are colour or depth, and of a kind that can be decoded."""
        if role not in CAMERAS:
            return True
        picture, named = candidate.typical.value, "depth" in candidate.topic.lower()
        deep = images.is_depth(picture) or (picture.encoding == "mono16" and named)
        if deep != (role == "depth"):
            if named and role == "depth" and picture.encoding:
                what = f"encoding {picture.encoding!r} is no depth, {images.USE}"
                self.problems.append(f"{candidate.topic}: {what}")
            return False
        problem = undecodable(role, candidate.choice)
        if problem:
            self.problems.append(f"{candidate.topic}: {problem}")
        return problem is None

    def _info(
        self, candidates: Sequence[Candidate], role: str, chosen: dict[str, Choice]
    ) -> Choice | None:
        """A camera info belongs to the images in whose folder it is, or with their frame and size.

        Depth may take the colour camera's where it is registered to colour: in its frame and size.
        """
        image, color = chosen[role], chosen["color"]
        topic, frame, size = image.channel.topic, image.typical().frame, _size(image)
        ranked = []
        for candidate in candidates:
            camera = candidate.typical.value.camera
            beside = _beside(candidate.topic, topic)
            of_color = _beside(candidate.topic, color.channel.topic)
            beside_it = beside and (role == "color" or not of_color)
            info_frame = camera.frame or (color.typical().frame if of_color else "")
            fits = size is None or size == (camera.width, camera.height)
            if beside_it or (info_frame == frame and (fits or beside)):
                why = f"beside {topic}" if beside else f"of the frame and size of {topic}"
                count = len(candidate.choice.channel.payloads)
                merit = beside_it, info_frame == frame, fits, beside, count
                ranked.append((merit, [-ord(c) for c in candidate.topic], why, candidate.choice))
            else:
                pixels = f", {size[0]} x {size[1]}" if size else ""
                self.problems.append(
                    f"{candidate.topic} is of frame {info_frame!r}, {camera.width} x"
                    f" {camera.height} pixels, {topic} of {frame!r}{pixels}: record the camera info"
                    f" of those images, or name it in setup.topics.{role}_info"
                )
        if not ranked:
            return None
        *_, why, choice = max(ranked, key=lambda entry: entry[:2])
        return replace(choice, why=why)


def _type(channel: Channel) -> str:
    return channel.schema.name or f"{channel.encoding} topic without a schema"


def _size(image: Choice) -> tuple[int, int] | None:
    """Width and height that most of the first pictures tell."""
    sizes, _ = readable(
        lambda payload: images.size_of(image.read(payload).value), image.channel.payloads
    )
    counted = Counter(size for size in sizes if size is not None)
    return counted.most_common(1)[0][0] if counted else None


def undecodable(role: str, choice: Choice) -> str | None:
    """Why none of some pictures of a topic can be decoded; None where one can."""
    payloads, reasons = choice.channel.payloads, Counter()
    for k in np.unique(np.linspace(0, len(payloads) - 1, min(TRIES, len(payloads))).astype(int)):
        try:
            getattr(images, role)(choice.read(payloads[k]).value)
        except images.Unsupported as error:
            reasons[str(error)] += 1
        except (images.Undecodable, Unreadable) as error:
            reasons[f"its {COLOUR[role]} pictures cannot be decoded: {error}"] += 1
        else:
            return None
    return reasons.most_common(1)[0][0]


def _source(topic: str) -> str:
    """A topic's name without that of the transport, by which one picture is sent several times."""
    return topic.removesuffix("/compressed").removesuffix("/compressedDepth")


def _nearest(depths: list[Candidate], color: Choice) -> list[Candidate]:
    """Those in the colour's frame, or else those that share the most folders with its topic."""
    frame, topic = color.typical().frame, color.channel.topic

    def near(depth: Candidate) -> tuple[bool, int]:
        folders = (name.split("/")[:-1] for name in (depth.topic, topic))
        return bool(frame) and depth.typical.frame == frame, len(commonprefix([*folders]))

    most = max(map(near, depths))
    return [depth for depth in depths if near(depth) == most]


def _beside(info: str, image: str) -> bool:
    """Whether the two are in one folder, the name of the image's transport left out."""
    folder, parts = info.split("/")[:-1], image.split("/")
    return any(folder) and folder in (parts[:-1], parts[:-2])


def _why(best: Candidate, candidates: list[Candidate]) -> str:
    if len(candidates) == 1:
        return f"the only {best.kind} for {best.role.what.partition(' (')[0]}"
    named = f"named {' '.join(best.hints)}, " if best.hints else ""
    others = sorted({candidate.topic for candidate in candidates} - {best.topic})[:2]
    rest = f"; not {', '.join(others)}" if others else ""
    return f"of {len(candidates)} topics: {named}{best.rate:.0f} Hz{rest}"


def transforms_of(container: Container) -> TransformTree:
    """All of tf_static; of /tf and of Foxglove's transforms those that keep still.

    Messages that cannot be read are left out: a transform that is missed is asked for later.
    """
    poses: dict[Edge, np.ndarray] = {}
    moving: set[Edge] = set()
    tree = TransformTree()
    for channel in container.channels:
        static = _is_static(channel)
        if kind_of(channel.schema.name) not in TRANSFORMS:
            continue
        try:
            decode = decoder(channel)
        except UserError:
            continue
        messages, _ = readable(message_reader(decode, edges_of), channel.payloads, None)
        for edge, pose in chain.from_iterable(messages):
            changes = np.abs(poses.get(edge, pose) - pose).max() > STILL
            if static and (changes or any(c == edge[1] and p != edge[0] for p, c in poses)):
                tree.doubled.add(edge[1])
            elif changes:
                moving.add(edge)
            poses[edge] = pose
    for edge, pose in poses.items():
        if edge not in moving:
            tree.add(*edge, Transform.of(pose))
    return tree


def _is_static(channel: Channel) -> bool:
    return channel.topic.rsplit("/", 1)[-1] == "tf_static"
