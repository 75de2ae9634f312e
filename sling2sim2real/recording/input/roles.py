"""The roles that topics play, how well a topic would play one, and how it is read for it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.input import readings as of
from sling2sim2real.recording.input.camera import read_calibration
from sling2sim2real.recording.input.contents import Channel
from sling2sim2real.recording.input.decode import (
    Decoder,
    Message,
    Unreadable,
    Value,
    message_reader,
)
from sling2sim2real.recording.input.kinematics import chain_of
from sling2sim2real.recording.input.readings import Reading
from sling2sim2real.settings.lab import SetupParams

TRIES = 9  # messages that are looked at to know a topic
JOINT_TRIES = 50  # of joints: some share their topic with other publishers
JOINTS_SHOWN = 12  # joints named in a message
FINGERS = ("finger", "gripper", "knuckle")
OPTIONAL = ("gripper",)
COMMANDS = ("goal", "desired", "command", "commanded", "cmd", "target", "reference", "setpoint")
THINGS = ("camera", "object", "tag", "marker")

Read = Callable[[Message], Reading]
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


def readable(
    read: Callable[[bytes], Value], payloads: Iterable[bytes], most: int | None = TRIES
) -> tuple[list[Value], str]:
    """What the first messages say that can be read, and why the last of the others cannot be."""
    reasons = ["all are damaged"]

    def readings() -> Iterator[Value]:
        for payload in payloads:
            try:
                yield read(payload)
            except Unreadable as error:
                reasons.append(str(error))

    return list(islice(readings(), most)), reasons[-1]


@dataclass(frozen=True)
class Role:
    """What a topic must be, and words in its name that speak for (+) or against (-) it.

    Attributes:
        what: It, in messages.
        readers: How each kind of schema is read, the best kinds first; None where it depends on
            the recording and on params (`source_of`).
        rate: Below it, a topic of the right type is not likely to be it [Hz].
        spare: Kinds that serve only where there is no other.
    """

    what: str
    readers: Mapping[str, Read | None]
    hints: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    rate: float = 0.0
    spare: tuple[str, ...] = ()


STATES = ("FrankaRobotState", "FrankaState")
JOINTS: dict[str, Read | None] = dict.fromkeys(("JointState", "JointStates"))
POSES = ("PoseStamped", "PoseInFrame", "PoseWithCovarianceStamped")
POSE: dict[str, Read] = dict.fromkeys(POSES, of.read_pose)
IMAGES: dict[str, Read] = dict.fromkeys(("Image", "RawImage", "CompressedImage"), of.read_image)
INFO: dict[str, Read] = dict.fromkeys(("CameraInfo", "CameraCalibration"), read_calibration)
CAMERAS = ("color", "depth")  # roles of pictures
ROLES = {
    "wrench": Role(
        "force (a geometry_msgs/WrenchStamped topic)",
        {"WrenchStamped": of.read_wrench, **dict.fromkeys(STATES, of.read_state_wrench)},
        hints=("ft", "force", "wrench"),
        doubts=(*COMMANDS, "estimated", "external", "filtered"),
        rate=50,
        spare=STATES,  # they estimate the force from the motors' torques
    ),
    "pose": Role(
        "end-effector pose (a geometry_msgs/PoseStamped topic)",
        {**POSE, **dict.fromkeys(STATES, of.read_state_pose), **JOINTS},
        hints=("current", "ee", "eef", "tcp", "end_effector", "measured"),
        doubts=(*COMMANDS, *THINGS),
        rate=10,
    ),
    "gripper": Role(
        "gripper (a sensor_msgs/JointState topic)",
        JOINTS,
        hints=("gripper", "finger", "hand"),
        doubts=COMMANDS,
    ),
    "color": Role(
        "colour images (a sensor_msgs/Image or CompressedImage topic)",
        IMAGES,
        hints=("color", "colour", "rgb"),
        doubts=("infra", "ir", "left", "right", "depth", "mask", "debug"),
    ),
    "depth": Role(
        "depth images (16UC1 or 32FC1, raw or compressedDepth)",
        IMAGES,
        hints=("aligned", "registered", "depth"),
        doubts=("mask", "debug"),
    ),
    "color_info": Role("camera info of the colour images", INFO),
    "depth_info": Role("camera info of the depth images", INFO),
}


@dataclass(frozen=True)
class Candidate:
    """A channel that could play a role."""

    role: Role
    choice: Choice
    typical: Reading

    @property
    def topic(self) -> str:
        return self.choice.channel.topic

    @property
    def kind(self) -> str:
        return of.kind_of(self.choice.channel.schema.name)

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
            -list(self.role.readers).index(self.kind),
            bool(self.hints),
        )

    def merit(self) -> tuple:
        """The standing; among topics of one standing number of messages, and the alphabet."""
        count = len(self.choice.channel.payloads)
        return *self.standing(), count, [-ord(c) for c in self.topic]


def source_of(
    role: str, channel: Channel, decode: Decoder, setup: SetupParams, named: bool
) -> Source | None:
    """How to read a channel for a role, and how to convert what was read.

    None where it is of the right type, but something else, which is no news to anybody.

    Args:
        role: One of ROLES; the channel's schema is among those of its readers.
        channel, decode: The topic.
        named: Whether params name the topic.

    Raises:
        UserError: where it would be if params said more, or if it could be read.
    """
    kind = of.kind_of(channel.schema.name)
    if role == "gripper":
        return _gripper(channel, decode, named)
    if role == "pose" and kind in JOINTS:
        return _arm(channel, decode, setup)
    read = ROLES[role].readers[kind]
    return read and (read, None)


def _gripper(channel: Channel, decode: Decoder, named: bool) -> Source | None:
    """The joints of a gripper, not of an arm; all joints where params name the topic."""
    by_topic = named or _has(FINGERS, channel.topic)
    for names in _joint_names(channel, decode):
        fingers = tuple(name for name in names if _has(FINGERS, name))
        if fingers or by_topic:
            only = tuple(name for name in fingers if "finger" in name.lower())
            moving = only or fingers or names
            return of.fingers_reader(moving), partial(
                of.opening_of, topic=channel.topic, names=moving
            )
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
    return of.joints_reader(chain.names, chain.root), chain.poses


def _joint_names(channel: Channel, decode: Decoder) -> list[tuple[str, ...]]:
    """Names in the first messages, the most frequent first. Raises UserError if there are none."""
    read = message_reader(decode, lambda message: tuple(of.joints_of(message)))
    messages, _ = readable(read, channel.payloads[:JOINT_TRIES], None)
    names = [some for some, _ in Counter(messages).most_common() if some]
    if not names:
        raise UserError(f"{channel.topic} has fewer than two readable messages (no positions)")
    return names


def _has(words: tuple[str, ...], name: str) -> bool:
    return any(word in name.lower() for word in words)
