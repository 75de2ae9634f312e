"""What was recorded of what an episode wants."""

from __future__ import annotations

from collections.abc import Iterator

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.processed import Processed

GRIPPER = Check(
    "gripper",
    "the recording's topics with those that tell of the grasp",
    "without a gripper the grasp is known to some 0.1 s",
    "no topic tells of the fingers",
    "neither the fingers nor a lift tell when the band is grasped",
    "record its joint states",
)
CHECKS = (GRIPPER,)


def findings(done: Processed) -> Iterator[Finding]:
    if not done.pull.recording.gripper:
        yield GRIPPER.found("the gripper was not recorded, so the grasp is read from the lift")
