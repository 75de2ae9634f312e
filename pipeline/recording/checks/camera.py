"""Where the camera puts fork tips and hand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.recording.checks.finding import Check, Finding
from pipeline.recording.geometry import Geometry
from pipeline.recording.processed import Processed
from pipeline.recording.tips import Tips

TIPS_OFF, HAND_OFF = 0.004, 0.006  # m
SURE = 3.0  # standard errors from which something is more than noise

EXTRINSICS = Check(
    "extrinsics",
    "the fork tips as the drawn band shows them with where they are",
    "standard error of the fit to all pictures of the drawn band",
    f"{1e3 * TIPS_OFF:g} mm and {SURE:g} standard errors, or too few pictures to tell",
    "",
    "calibrate it again, or set setup.camera_to_fork in params.yaml",
)
HAND = Check(
    "hand",
    "the end of the drawn band with the tool centre point",
    "standard error of the fit to all pictures of the drawn band",
    f"{1e3 * HAND_OFF:g} mm and {SURE:g} standard errors",
    "",
    "check base_to_fork, the tool centre point, and where the pads hold the band",
)
CHECKS = (EXTRINSICS, HAND)


def findings(done: Processed) -> Iterator[Finding]:
    tips = done.tips
    if tips is None:
        what = "too few pictures of the drawn band to tell how far the fork tips are off"
        yield Finding(EXTRINSICS.name, what, "pull slowly, and further")
        return
    off, error = tips.off, tips.off_error
    if off > max(TIPS_OFF, SURE * error):
        pose = ", ".join(f"{number:g}" for number in camera_to_fork(tips, done.pull.geometry))
        yield Finding(
            EXTRINSICS.name,
            f"the camera shows the fork tips {1e3 * off:.1f} ± {1e3 * error:.1f} mm off",
            f"calibrate it again, or set setup.camera_to_fork: [{pose}] in params.yaml",
        )
    off, error = tips.hand_off, tips.hand_off_error
    if off > max(HAND_OFF, SURE * error):
        what = f"the band ends {1e3 * off:.1f} ± {1e3 * error:.1f} mm from the tool centre point"
        yield Finding(HAND.name, what, HAND.remedy)


def camera_to_fork(tips: Tips, geometry: Geometry) -> list[float]:
    """As setup has it: what would put the camera's clouds in their place."""
    believed = geometry.camera @ geometry.color.inverse()
    pose = (tips.correction @ believed).inverse()
    parts = np.array([*pose.translation, *pose.rotation.as_quat(canonical=True)])
    return [round(float(number), 6) for number in parts]
