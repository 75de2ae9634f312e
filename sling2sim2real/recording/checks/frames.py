"""Where things are said to stand: the sensor, and the loop of transforms."""

from __future__ import annotations

from collections.abc import Iterator

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.processed import Processed

SENSOR = Check(
    "sensor",
    "the force's frame with those of /tf_static",
    "none: it is there or not",
    "it is not there, and is taken as the hand's",
    "",
    "publish how the sensor is turned relative to the tool centre point",
)
LOOP = Check(
    "loop",
    "setup.base_to_fork and setup.camera_to_fork with /tf_static, around the loop",
    "the touched tips' and the calibration's",
    "the loop does not close within them",
    "",
    "touch the tips or calibrate the camera again (docs/recording.md, Calibration)",
)
CHECKS = (SENSOR, LOOP)


def findings(done: Processed) -> Iterator[Finding]:
    recording, geometry = done.pull.recording, done.pull.geometry
    frame = recording.wrench.frame
    if frame not in recording.transforms.frames and not geometry.sensor_is_fixed:
        what = f"/tf_static does not know the force's frame {frame!r}, so it is taken as the hand's"
        yield SENSOR.found(what)
    if geometry.loop and not geometry.loop.closed:
        given = [
            f"setup.{name}"
            for name in ("base_to_fork", "camera_to_fork")
            if geometry.sources[name].startswith("setup")
        ]
        cure = f"{' or '.join(given)} contradicts /tf_static: {LOOP.remedy}"
        yield LOOP.found(str(geometry.loop), cure)
