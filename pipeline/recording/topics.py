"""Which topic plays which role: by params, else by type, hints in the name, and rate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipeline.errors import UserError
from pipeline.recording.container import Channel, Container
from pipeline.recording.decode import decoder
from pipeline.recording.images import is_depth

IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
OPTIONAL = ("gripper",)


@dataclass(frozen=True)
class Role:
    """What a topic must be, and words in its name that speak for (+) or against (-) it."""

    types: tuple[str, ...]
    what: str
    hints: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


ROLES = {
    "wrench": Role(
        ("geometry_msgs/msg/WrenchStamped",),
        "force (a geometry_msgs/WrenchStamped topic)",
        hints=("ft", "force", "wrench"),
        doubts=("desired", "command", "target", "estimated"),
    ),
    "pose": Role(
        ("geometry_msgs/msg/PoseStamped",),
        "end-effector pose (a geometry_msgs/PoseStamped topic)",
        hints=("current", "ee", "tcp", "end_effector", "measured"),
        doubts=("goal", "desired", "command", "target"),
    ),
    "gripper": Role(
        ("sensor_msgs/msg/JointState",), "gripper", hints=("gripper", "finger", "hand")
    ),
    "color": Role(
        IMAGES,
        "colour images (a sensor_msgs/Image or CompressedImage topic)",
        hints=("color", "colour", "rgb"),
        doubts=("infra", "ir", "left", "right", "mask", "debug"),
    ),
    "depth": Role(
        IMAGES,
        "depth images (16UC1 or 32FC1, raw or compressedDepth)",
        hints=("aligned", "registered", "depth"),
        doubts=("mask", "debug"),
    ),
    "color_info": Role(("sensor_msgs/msg/CameraInfo",), "camera info of the colour images"),
    "depth_info": Role(("sensor_msgs/msg/CameraInfo",), "camera info of the depth images"),
}


@dataclass(frozen=True)
class Choice:
    """A channel and how to read it."""

    channel: Channel
    decode: Callable[[bytes], object]

    def first(self) -> object:
        """The first readable message. Raises UserError."""
        for payload in self.channel.payloads:
            try:
                return self.decode(payload)
            except Exception:  # whatever damaged bytes do to the decoder
                continue
        raise UserError(f"topic {self.channel.topic}: no message can be read")


def choose(container: Container, wanted: object) -> dict[str, Choice]:
    """Role to channel. Raises UserError for a role that nothing can play.

    Args:
        container: What was read.
        wanted: params.setup.topics: a topic's name for a role, or None.
    """
    chosen: dict[str, Choice] = {}
    for role in ROLES:
        choice = _one(container, role, getattr(wanted, role), chosen)
        if choice:
            chosen[role] = choice
        elif role not in OPTIONAL:
            has = ", ".join(sorted({c.topic for c in container.channels})) or "no topics at all"
            raise UserError(f"{container.path}: no {ROLES[role].what}; the file has {has}")
    return chosen


def _one(
    container: Container, role: str, wanted: str | None, chosen: dict[str, Choice]
) -> Choice | None:
    named = [c for c in container.channels if wanted in (None, c.topic)]
    if wanted and not named:
        raise UserError(f"{container.path}: setup.topics.{role}: no topic {wanted}")
    found = [_choice(container.path, c) for c in named if _type(c) in ROLES[role].types]
    if wanted and not found:
        types = " or ".join(ROLES[role].types)
        raise UserError(
            f"{container.path}: setup.topics.{role}: {wanted} is a {_type(named[0])}, not {types}"
        )
    if role in ("color", "depth") and not wanted:
        found = [c for c in found if is_depth(c.first()) == (role == "depth")]
    if role == "gripper" and not wanted:
        found = [c for c in found if _has_fingers(c)]
    if role.endswith("_info"):
        image = chosen[role.removesuffix("_info")]
        return max(found, key=lambda c: _belongs(c, image), default=None)
    return max(found, key=lambda c: _merit(c, ROLES[role]), default=None)


def _choice(path: Path, channel: Channel) -> Choice:
    return Choice(channel, decoder(channel))


def _type(channel: Channel) -> str:
    """pkg/msg/Type, also where the middle is left out."""
    parts = channel.schema.name.split("/")
    return f"{parts[0]}/msg/{parts[-1]}"


def _merit(choice: Choice, role: Role) -> tuple:
    """More hints first, then more messages, then the alphabet: the choice is reproducible."""
    words = choice.channel.topic.lower().replace("/", "_").split("_")
    name = choice.channel.topic.lower()
    hints = sum(hint in words or (len(hint) > 3 and hint in name) for hint in role.hints)
    doubts = sum(doubt in words for doubt in role.doubts)
    return (-doubts, hints, len(choice.channel.payloads), [-ord(c) for c in name])


def _has_fingers(choice: Choice) -> bool:
    """A gripper's joint states, not an arm's."""
    names = [name.lower() for name in choice.first().name]
    words = ("finger", "gripper", "knuckle")
    return any(word in text for text in (choice.channel.topic.lower(), *names) for word in words)


def _belongs(info: Choice, image: Choice) -> tuple:
    """A camera info belongs to the images beside it, with their frame."""
    same_frame = info.first().header.frame_id == image.first().header.frame_id
    a, b = info.channel.topic.split("/"), image.channel.topic.split("/")
    shared = sum(1 for _ in _while_equal(a, b))
    return (shared, same_frame, len(info.channel.payloads))


def _while_equal(a: list[str], b: list[str]):
    for x, y in zip(a, b, strict=False):
        if x != y:
            return
        yield x
