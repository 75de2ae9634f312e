"""A recording of one pull or several, pull by pull, and each pull's events: grasp and release.

Labs record several pulls into one file: the hand lets go, returns, and grasps again. A pull's part
of the file begins when the hand is free of the pull before and ends when it grasps for the next
one: the free hand between two pulls ends the one and leads in the other. Each part has a grasp, a
release, a tare and delays of its own, and is judged by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.grasp import MARGIN, Opening, find_grasp
from sling2sim2real.recording.motion import Motion, expect_dense
from sling2sim2real.recording.release import SETTLE, Release, find_release, find_releases
from sling2sim2real.recording.streams import Recording
from sling2sim2real.recording.zero import NewZero, zeroed

CALM = 3.0  # s after a release until the band hangs at rest again, to some 2 mm
APART = 1.0  # s: what is let go twice within this is one pull, and not understood


@dataclass(frozen=True)
class Part:
    """What was recorded of one pull, and where things stand.

    Attributes:
        recording: The streams.
        geometry: Static transforms.
        number, count: Which of the file's pulls this is, from 1 on, and of how many.
    """

    recording: Recording
    geometry: Geometry
    number: int = 1
    count: int = 1


@dataclass(frozen=True)
class Pull(Part):
    """One pull and its events. Times are seconds since the file's first force.

    Attributes:
        force_time: Times of the force's samples [s], shape (S,).
        force: In the wrench's frame, with the sensor's zero at the end [N], shape (S, 3).
        zeroed: Times at which the sensor was zeroed, and by how much: `force` is without these.
        opening: Times [s] and opening of the gripper; None where it was not recorded.
        motion: Of the hand.
        release: The end of the pull.
        grasp: Time at which the band is grasped [s].
    """

    force_time: np.ndarray = field(kw_only=True)
    force: np.ndarray = field(kw_only=True)
    zeroed: list[NewZero] = field(kw_only=True)
    opening: Opening | None = field(kw_only=True)
    motion: Motion = field(kw_only=True)
    release: Release = field(kw_only=True)
    grasp: float = field(kw_only=True)

    @classmethod
    def of(cls, part: Part) -> Pull:
        """Find the events of a pull. Raises UserError where the recording does not show them."""
        recording = part.recording
        motion = Motion.of(recording.pose, part.geometry, recording.origin)
        time, force, zeros = _force_of(recording, motion)
        opening = _opening_of(recording)
        release = find_release(time, force, opening)
        if bursts := recording.wrench.bursts:
            error = float(np.hypot(release.error, 1e-9 * bursts.error))
            release = replace(release, error=error)
        return cls(
            **{name: getattr(part, name) for name in ("recording", "geometry", "number", "count")},
            force_time=time,
            force=force,
            zeroed=zeros,
            opening=opening,
            motion=motion,
            release=release,
            grasp=find_grasp(opening, (motion.time, motion.path), release.time),
        )

    def shifted(self, pose: float = 0.0, camera: float = 0.0) -> Pull:
        """Copy with stamps that are late by so many seconds put right.

        The pose's clock tells the motion and the grasp, which are found anew where it changes; the
        camera's tells neither. Raises UserError.
        """
        if not pose and not camera:
            return self
        moved = replace(self, recording=self.recording.shifted(pose, camera))
        if not pose:
            return moved
        motion = Motion.of(moved.recording.pose, self.geometry, self.recording.origin)
        grasp = find_grasp(self.opening, (motion.time, motion.path), self.release.time)
        return replace(moved, motion=motion, grasp=grasp)


def parts_of(recording: Recording, geometry: Geometry) -> list[Part]:
    """List a recording's pulls in time order; all of it where it is one or not understood.

    Raises:
        UserError: Several pulls are in it, but not where the hand is.
    """
    try:
        motion = Motion.of(recording.pose, geometry, recording.origin)
    except UserError:  # which is said where the motion is needed
        motion = None
    time, force, _ = _force_of(recording, motion)
    releases = np.array(find_releases(time, force, _opening_of(recording)))
    if len(releases) < 2 or np.diff(releases).min() < APART:
        return [Part(recording, geometry)]
    expect_dense(recording.pose)
    begins = [float(time[0]), *(releases[:-1] + SETTLE)]
    last = max(stream.seconds(recording.origin)[-1] for stream in recording.streams.values())
    ends = [
        _next_grasp(Part(recording.part(begin, release + SETTLE), geometry), release)
        for begin, release in zip(begins[1:], releases[1:], strict=True)
    ]
    ends = [*(end - MARGIN for end in ends), last]
    return [
        Part(recording.part(begin, end), geometry, number, len(begins))
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True), start=1)
    ]


def _force_of(
    recording: Recording, motion: Motion | None
) -> tuple[np.ndarray, np.ndarray, list[NewZero]]:
    """Times of the force, the force with the zero that it has at the end, and its new zeros."""
    time = recording.wrench.seconds(recording.origin)
    hand = None if motion is None else motion.position
    return time, *zeroed(time, recording.wrench.values, hand)


def _opening_of(recording: Recording) -> Opening | None:
    gripper = recording.gripper
    return gripper and (gripper.seconds(recording.origin), gripper.values[:, 0])


def _next_grasp(between: Part, release: float) -> float:
    """Time [s] of the next grasp, of the band let go at `release`; half way where nothing tells.

    Args:
        between: From the pull before to this one.
    """
    recording = between.recording
    motion = Motion.of(recording.pose, between.geometry, recording.origin)
    try:
        return find_grasp(_opening_of(recording), (motion.time, motion.path), release)
    except UserError:
        return (recording.wrench.seconds(recording.origin)[0] + release) / 2
