"""MCAP file to `Recording`: which topic is which, their signals on header stamps, checked.

Everything comes sorted by header.stamp. log_time is when a message was received: it is late and
jitters, so it only shows what is wrong with a stamp's clock and helps to mend it (`clocks`), or
stands in for a gripper's stamps where there are none.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.input import images
from sling2sim2real.recording.input.bag import sha256
from sling2sim2real.recording.input.camera import Camera
from sling2sim2real.recording.input.container import Container, read_container
from sling2sim2real.recording.input.frames import TransformTree
from sling2sim2real.recording.input.readings import Picture
from sling2sim2real.recording.input.roles import CAMERAS
from sling2sim2real.recording.input.stream import Stream
from sling2sim2real.recording.input.streams import streams_of
from sling2sim2real.recording.input.topics import camera_of, choose
from sling2sim2real.recording.input.transforms import transforms_of
from sling2sim2real.recording.input.words import shortened
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.settings.recording import DelayParams

SHOWN = 3  # losses in an error
LINE, LOSS = 1000, 300  # characters of an error and of a loss in it
STREAMS = ("wrench", "pose", "gripper", *CAMERAS)


@dataclass(frozen=True)
class Recording:
    """What was read of one file, or the part of it that one of its pulls takes.

    Attributes:
        wrench: Force [N] in `wrench.frame`, values (S, 3).
        pose: Position [m] and quaternion xyzw in `pose.frame`, values (S, 7).
        gripper: Sum of the finger positions, as they are reported [m], values (S, 1); None where
            not recorded.
        color, depth: `Picture`s, decoded by `sling2sim2real.recording.input.images`.
        color_camera, depth_camera: Their intrinsics.
        transforms: The static tree.
        losses: What was lost of the file or mended in it, in words.
        notes: What else to know of it, which cost nothing.
        choices: Why each role has its topic.
        sha256: Hash of the file.
        start: From which seconds count [ns]: the file's first force, also in a part of it; None
            for that of `wrench`.
        late: By what the stamps of a role were given to be late [s], and are not any more.
    """

    path: Path
    wrench: Stream[np.ndarray]
    pose: Stream[np.ndarray]
    gripper: Stream[np.ndarray] | None
    color: Stream[list[Picture]]
    depth: Stream[list[Picture]]
    color_camera: Camera
    depth_camera: Camera
    transforms: TransformTree
    losses: list[str] = field(default_factory=list)
    sha256: str = ""
    notes: list[str] = field(default_factory=list)
    choices: dict[str, str] = field(default_factory=dict)
    start: int | None = None
    late: dict[str, float] = field(default_factory=dict)

    @property
    def origin(self) -> int:
        """Stamp from which seconds count [ns]."""
        return int(self.wrench.stamp[0]) if self.start is None else self.start

    @property
    def streams(self) -> dict[str, Stream[Any]]:
        by_role = {role: getattr(self, role) for role in STREAMS}
        return {role: stream for role, stream in by_role.items() if stream}

    def depth_picture(self, number: int) -> np.ndarray | None:
        """Depth [m], 0 where unknown, of the camera's size (H, W); None where it is damaged."""
        try:
            depth = images.depth(self.depth.values[number])
        except images.Undecodable:
            return None
        return depth if depth.shape == (self.depth_camera.height, self.depth_camera.width) else None

    def part(self, begin: float, end: float) -> Recording:
        """What was recorded from `begin` to `end` [s]."""
        first, last = (self.origin + round(time * 1e9) for time in (begin, end))
        cut = {role: stream.between(first, last) for role, stream in self.streams.items()}
        return replace(self, **cut, start=self.origin)

    def shifted(self, pose: float = 0.0, camera: float = 0.0) -> Recording:
        """Copy with stamps that are late by so many seconds put right."""
        return replace(
            self,
            pose=self.pose.shifted(pose),
            color=self.color.shifted(camera),
            depth=self.depth.shifted(camera),
        )


def read_recording(path: Path, setup: SetupParams, delays: DelayParams | None = None) -> Recording:
    """Read and check a recording. Raises UserError with one line about what is missing or wrong.

    Args:
        delays: By what stamps are known to be late [s]: taken off before clocks are compared.
    """
    return recording_of(read_container(Path(path)), setup, delays)


def recording_of(
    container: Container, setup: SetupParams, delays: DelayParams | None = None
) -> Recording:
    """Do what `read_recording` does, from a file that was read already."""
    try:
        transforms = transforms_of(container)
        chosen = choose(container, setup)
        color_camera, depth_camera = (camera_of(chosen, role) for role in CAMERAS)
        by_role = {role: chosen[role] for role in STREAMS if role in chosen}
        late = late_by(delays)
        streams, remarks = streams_of(by_role, late)
    except UserError as error:
        raise explained(error, container.path, container.losses) from None
    lost = [f"{stream.topic}: {note}" for stream in streams.values() for note in stream.notes]
    return Recording(
        path=container.path,
        wrench=streams["wrench"],
        pose=streams["pose"],
        gripper=streams.get("gripper"),
        color=streams["color"],
        depth=streams["depth"],
        color_camera=color_camera,
        depth_camera=depth_camera,
        transforms=transforms,
        losses=[*container.losses, *lost],
        notes=[*container.notes, *remarks],
        choices={role: choice.why for role, choice in chosen.items()},
        sha256=sha256(container.path),
        late={role: seconds for role, seconds in late.items() if role in streams},
    )


def late_by(delays: DelayParams | None) -> dict[str, float]:
    """Seconds by which the stamps of each role are given to be late; none where nothing is."""
    given = {"pose": delays and delays.pose, "camera": delays and delays.camera}
    roles = {"pose": ("pose",), "camera": CAMERAS}
    return {role: late for name, late in given.items() if late for role in roles[name]}


def explained(error: UserError, path: Path, losses: list[str], pull: str = "") -> UserError:
    """The error with the file's name, the pull, and with what was lost, which may be its cause."""
    text = str(error).removeprefix(f"{path}: ")
    text = shortened(f"{pull}: {text}" if pull else text, LINE)
    text = text if str(path) in text else f"{path}: {text}"
    shown = [shortened(loss, LOSS) for loss in losses[:SHOWN]]
    shown += ["and more"] * (len(losses) > SHOWN)
    return UserError(printable(f"{text} ({'; '.join(shown)})" if losses else text))
