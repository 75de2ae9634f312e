"""One recorded pull and what follows from its streams; a recording of several, pull by pull.

Labs record several pulls into one file: the hand lets go, returns, and grasps again. A pull's part
of the file begins when the hand is free of the pull before and ends when it grasps for the next
one: the free hand between two pulls ends the one and leads in the other. Each part has a grasp, a
release, a tare and delays of its own, and is judged by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.geometry import Geometry, geometry_of
from sling2sim2real.recording.grasp import MARGIN, Opening, find_grasp
from sling2sim2real.recording.input.reader import Recording
from sling2sim2real.recording.motion import Motion, expect_dense
from sling2sim2real.recording.release import SETTLE, Release, find_release, find_releases
from sling2sim2real.recording.zero import NewZero, zeroed
from sling2sim2real.settings.lab import SetupParams

CALM = 3.0  # s after a release until the band hangs at rest again, to some 2 mm
APART = 1.0  # s: what is let go twice within this is one pull, and not understood
# What a delay of the pose does not change.
UNMOVED = ("force_time", "_zeroed", "opening", "release")


@dataclass(frozen=True)
class Pull:
    """One pull: its streams on one clock, where things stand, and what is derived of both.

    Everything derived is computed when it is first asked for, once; it raises UserError where the
    recording does not show it. Times are seconds since the file's first force.

    Attributes:
        recording: The streams.
        geometry: Static transforms.
        number, count: Which of the file's pulls this is, from 1 on, and of how many.
    """

    recording: Recording
    geometry: Geometry
    number: int = 1
    count: int = 1

    @classmethod
    def of(cls, recording: Recording, setup: SetupParams) -> Pull:
        """The whole recording as if it were one pull; `pulls_of` parts it.

        Raises UserError where a frame is missing.
        """
        return cls(recording, geometry_of(recording, setup))

    @cached_property
    def force_time(self) -> np.ndarray:
        """Times of the force's samples [s], shape (S,)."""
        return self.recording.wrench.seconds(self.recording.origin)

    @property
    def force(self) -> np.ndarray:
        """Force [N] in the wrench's frame, with the sensor's zero at the end, shape (S, 3)."""
        return self._zeroed[0]

    @property
    def zeroed(self) -> list[NewZero]:
        """Times at which the sensor was zeroed, and by how much: `force` is without these steps."""
        return self._zeroed[1]

    @cached_property
    def _zeroed(self) -> tuple[np.ndarray, list[NewZero]]:
        try:
            hand = self.motion.position
        except UserError:  # which is said where the motion is needed
            hand = None
        return zeroed(self.force_time, self.recording.wrench.values, hand)

    @cached_property
    def opening(self) -> Opening | None:
        """Times [s] and opening [m] of the gripper; None where it was not recorded."""
        gripper = self.recording.gripper
        return gripper and (gripper.seconds(self.recording.origin), gripper.values[:, 0])

    @cached_property
    def motion(self) -> Motion:
        return Motion.of(self.recording.pose, self.geometry, self.recording.origin)

    @cached_property
    def release(self) -> Release:
        found_release = find_release(self.force_time, self.force, self.opening)
        bursts = self.recording.wrench.bursts
        if bursts:
            found_release = replace(
                found_release, error=float(np.hypot(found_release.error, 1e-9 * bursts.error))
            )
        return found_release

    @cached_property
    def releases(self) -> list[float]:
        """About when the pulls of a recording of several end [s]."""
        return find_releases(self.force_time, self.force, self.opening)

    @cached_property
    def grasp(self) -> float:
        """Time at which the band is grasped [s]."""
        return self.grasp_before(self.release.time)

    def grasp_before(self, release: float) -> float:
        """Time at which the band is grasped [s] that is let go at `release` [s]."""
        return find_grasp(self.opening, (self.motion.time, self.motion.path), release)

    def shifted(self, pose: float = 0.0, camera: float = 0.0) -> Pull:
        """Copy with stamps that are late by so many seconds put right.

        The pose's clock tells the motion and the grasp, which are estimated anew where it changes;
        the camera's tells neither.
        """
        moved = replace(self, recording=self.recording.shifted(pose, camera))
        retained = UNMOVED if pose else (*UNMOVED, "motion", "grasp")
        vars(moved).update({name: vars(self)[name] for name in retained if name in vars(self)})
        return moved


def pulls_of(whole: Pull) -> list[Pull]:
    """List a recording's pulls in time order; `whole` itself where it is one or not understood.

    Raises:
        UserError: Several pulls are in it, but not where the hand is.
    """
    recording, releases = whole.recording, np.array(whole.releases)
    if len(releases) < 2 or np.diff(releases).min() < APART:
        return [whole]
    expect_dense(recording.pose)
    begins = [float(whole.force_time[0]), *(releases[:-1] + SETTLE)]
    last = max(stream.seconds(recording.origin)[-1] for stream in recording.streams.values())
    ends = [
        _next_grasp(replace(whole, recording=recording.part(begin, release + SETTLE)), release)
        for begin, release in zip(begins[1:], releases[1:], strict=True)
    ]
    ends = [*(end - MARGIN for end in ends), last]
    return [
        Pull(recording.part(begin, end), whole.geometry, number, len(begins))
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True), start=1)
    ]


def _next_grasp(between: Pull, release: float) -> float:
    """Time [s] of the next grasp, of the band let go at `release`; half way where nothing tells.

    Args:
        between: From the pull before to this one.
    """
    _ = between.motion  # what is wrong with it is not to be guessed around
    try:
        return between.grasp_before(release)
    except UserError:
        return (between.force_time[0] + release) / 2
