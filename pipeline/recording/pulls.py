"""A recording of several pulls, one after the other, as a recording of each.

Labs record that way: the hand lets go, returns, and grasps again. A pull's part of the file begins
when the hand is free of the pull before and ends when it grasps for the next one: the free hand
between two pulls ends the one and leads in the other. Each part has a grasp, a release, a tare and
delays of its own, and is judged by itself.
"""

from __future__ import annotations

import numpy as np

from pipeline.base.errors import UserError
from pipeline.recording.events import MARGIN, SETTLE, find_grasp, opening_of, releases_of
from pipeline.recording.geometry import Geometry, geometry_of
from pipeline.recording.input.reader import Recording
from pipeline.recording.motion import Motion, expect_dense

CALM = 3.0  # s after a release until the band hangs at rest again, to some 2 mm
APART = 1.0  # s: what is let go twice within this is one pull, and not understood


def pulls_of(recording: Recording, setup: object) -> list[Recording]:
    """Each pull in time order; the recording itself where it holds one, or is not understood.

    Args:
        setup: That section of params.

    Raises:
        UserError: Several pulls are in it, but not where the hand is.
    """
    releases = np.array(releases_of(recording))
    if len(releases) < 2 or np.diff(releases).min() < APART:
        return [recording]
    geometry, origin = geometry_of(recording, setup), recording.origin
    expect_dense(recording.pose)
    begins = [float(recording.wrench.seconds(origin)[0]), *(releases[:-1] + SETTLE)]
    last = max(stream.seconds(origin)[-1] for stream in recording.streams.values())
    ends = [
        _next_grasp(recording.part(begin, release + SETTLE), geometry, release) - MARGIN
        for begin, release in zip(begins[1:], releases[1:], strict=True)
    ]
    return [
        recording.part(begin, end, number, len(begins))
        for number, (begin, end) in enumerate(zip(begins, [*ends, last], strict=True), start=1)
    ]


def _next_grasp(between: Recording, geometry: Geometry, release: float) -> float:
    """When the band is grasped again [s] to be let go at `release`; half way where nothing tells.

    Args:
        between: From the pull before to this one.
    """
    motion = Motion.of(between.pose, geometry, between.origin)
    try:
        gripper = opening_of(between, between.origin)
        return find_grasp(gripper, (motion.time, motion.path), release)
    except UserError:
        return (between.wrench.seconds(between.origin)[0] + release) / 2
