"""The roles that topics play, and how well a topic would play one."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.base.errors import UserError
from pipeline.recording.input import readings as of
from pipeline.recording.input.camera import read_calibration
from pipeline.recording.input.container import Channel
from pipeline.recording.input.readings import Reading

TRIES = 9  # messages that are looked at to know a topic
OPTIONAL = ("twist", "gripper")
COMMANDS = ("goal", "desired", "command", "commanded", "cmd", "target", "reference", "setpoint")
THINGS = ("camera", "object", "tag", "marker")

Read = Callable[[object], Reading]
Convert = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Choice:
    """A channel, how to read it, and why it was chosen.

    Attributes:
        channel: Raw payloads.
        read: Payload to reading; raises anything on damaged bytes.
        why: One phrase.
        convert: Sorted stamps [ns], shape (S,), and values, shape (S, C), to what the role asks
            for, shape (S, 7); None where the values are that already.
    """

    channel: Channel
    read: Callable[[bytes], Reading]
    why: str = ""
    convert: Convert | None = None

    def typical(self, key: Callable[[Reading], object] | None = None) -> Reading:
        """One of the first messages that can be read, like most of them. Raises UserError.

        Args:
            key: What is alike in messages that are alike; None: frame and kind of picture.
        """
        found, reason = [], "all are damaged"
        for payload in self.channel.payloads:
            try:
                found.append(self.read(payload))
            except Exception as error:  # whatever damaged bytes do to the decoder
                reason = str(error).partition("\n")[0] or reason
            if len(found) == TRIES:
                break
        if not found:
            raise UserError(f"{self.channel.topic} has fewer than two readable messages ({reason})")
        key = key or (lambda one: (one.frame, getattr(one.value, "kind", None)))
        kinds = [key(one) for one in found]
        return found[kinds.index(Counter(kinds).most_common(1)[0][0])]


@dataclass(frozen=True)
class Role:
    """What a topic must be, and words in its name that speak for (+) or against (-) it.

    Attributes:
        readers: How each kind of schema is read, the best kinds first; None where it depends on
            the recording and on params (`sources`).
        what: It, in messages.
        rate: Below it, a topic of the right type is not likely to be it [Hz].
        spare: Kinds that serve only where there is no other.
    """

    readers: dict[str, Read | None]
    what: str
    hints: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    rate: float = 0.0
    spare: tuple[str, ...] = ()


INFO = dict.fromkeys(of.INFOS, read_calibration)
ROLES = {
    "wrench": Role(
        {**of.WRENCH, **of.STATE_WRENCH},
        "force (a geometry_msgs/WrenchStamped topic)",
        hints=("ft", "force", "wrench"),
        doubts=(*COMMANDS, "estimated", "external", "filtered"),
        rate=50,
        spare=of.STATES,  # they estimate the force from the motors' torques
    ),
    "pose": Role(
        {**of.POSE, **of.STATE_POSE, **dict.fromkeys(of.JOINTS), **dict.fromkeys(of.TWIST)},
        "end-effector pose (a geometry_msgs/PoseStamped topic)",
        hints=("current", "ee", "eef", "tcp", "end_effector", "measured"),
        doubts=(*COMMANDS, *THINGS),
        rate=10,
    ),
    "twist": Role(
        of.TWIST,
        "end-effector twist (a geometry_msgs/TwistStamped topic)",
        hints=("current", "ee", "eef", "tcp", "end_effector", "measured"),
        doubts=(*COMMANDS, *THINGS),
        rate=10,
    ),
    "gripper": Role(
        dict.fromkeys(of.JOINTS),
        "gripper (a sensor_msgs/JointState topic)",
        hints=("gripper", "finger", "hand"),
        doubts=COMMANDS,
    ),
    "color": Role(
        of.IMAGES,
        "colour images (a sensor_msgs/Image or CompressedImage topic)",
        hints=("color", "colour", "rgb"),
        doubts=("infra", "ir", "left", "right", "depth", "mask", "debug"),
    ),
    "depth": Role(
        of.IMAGES,
        "depth images (16UC1 or 32FC1, raw or compressedDepth)",
        hints=("aligned", "registered", "depth"),
        doubts=("mask", "debug"),
    ),
    "color_info": Role(INFO, "camera info of the colour images"),
    "depth_info": Role(INFO, "camera info of the depth images"),
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
        """Those in the topic's name: whole words, or long ones within words."""
        name = self.topic.lower()
        return [h for h in self.role.hints if h in self._words or (len(h) > 3 and h in name)]

    @property
    def doubts(self) -> list[str]:
        return [doubt for doubt in self.role.doubts if doubt in self._words]

    @property
    def _words(self) -> list[str]:
        return re.findall("[a-z]+", self.topic.lower())  # infra1 is infra

    def merit(self) -> tuple:
        """Measured, not spare, no doubts, a likely rate, kind, hints, messages; the alphabet."""
        return (
            not set(self.doubts) & set(COMMANDS),
            self.kind not in self.role.spare,
            -len(self.doubts),
            self.rate >= self.role.rate,
            -list(self.role.readers).index(self.kind),
            len(self.hints),
            len(self.choice.channel.payloads),
            [-ord(c) for c in self.topic],
        )
