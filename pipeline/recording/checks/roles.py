"""What was recorded of what an episode wants."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.recording.checks.finding import Check, Finding
from pipeline.recording.processed import Processed

GRIPPER = Check(
    "gripper",
    "the recording's topics with those that tell of the grasp",
    "without a gripper the grasp is known to some 0.1 s",
    "no topic tells of the fingers",
    "neither the fingers nor a lift tell when the band is grasped",
    "record its joint states",
)
SETS = Check(
    "topics",
    "the topics that were chosen with others of their types, by device and by what moves together",
    "none: another set with a release, or another camera, is named",
    "another set of topics would do as well",
    "",
    "name the topics that are meant in setup.topics of params.yaml",
)
CHECKS = (GRIPPER, SETS)


def findings(done: Processed) -> Iterator[Finding]:
    if not done.pull.recording.gripper:
        yield GRIPPER.found("the gripper was not recorded, so the grasp is read from the lift")
    streams = done.pull.recording.streams
    for role, doubt in done.pull.recording.doubts.items():
        yield SETS.found(f"{streams[role].topic} was taken, but {doubt}")
