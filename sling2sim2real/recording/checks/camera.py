"""Where the camera puts fork tips and hand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.geometry import Geometry
from sling2sim2real.recording.processed import Processed
from sling2sim2real.recording.tips import MATTERS, SURE, Tips

HAND_OFF = 0.006  # m
HAND_SURE = 3.0  # standard errors

EXTRINSICS = Check(
    "extrinsics",
    "the fork tips as the drawn band shows them with where they are, each component by itself, and"
    " how the band is turned",
    "standard errors of the fit to all pictures of the drawn band",
    f"components of more than {SURE:g} standard errors add up to {1e3 * MATTERS:g} mm, of a tip or"
    " by the turn; or too few pictures to tell",
    "",
    "calibrate it again, or set setup.camera_to_fork in params.yaml",
)
LENS = Check(
    "lens",
    "the fork tips and the band's turn as the drawn band shows them with what one factor of the"
    " depth, or of the focal length, does to them",
    "standard error of the factor, 0.1 % at least",
    f"what is off is explained by one factor that is {SURE:g} standard errors from 1",
    "the band is not found, and the hand's depth is off by a factor",
    "calibrate the camera's depth and its focal length",
)
HAND = Check(
    "hand",
    "the end of the drawn band with the tool centre point",
    "standard error of the fit to all pictures of the drawn band",
    f"{1e3 * HAND_OFF:g} mm and {HAND_SURE:g} standard errors",
    "",
    "check base_to_fork, the tool centre point, and where the pads hold the band",
)
CHECKS = (EXTRINSICS, LENS, HAND)


def findings(done: Processed) -> Iterator[Finding]:
    tips = done.tips
    if tips is None:
        what = "too few pictures of the drawn band to tell how far the fork tips are off"
        cure = "pull slowly, and further; where the band is seen, check the camera's depth and pose"
        yield EXTRINSICS.found(what, cure)
        return
    yield from _of_pose(tips, done.pull.geometry)
    off, error = tips.hand_off, tips.hand_off_error
    if off > max(HAND_OFF, HAND_SURE * error):
        what = f"the band ends {1e3 * off:.1f} ± {1e3 * error:.1f} mm from the tool centre point"
        yield HAND.found(what)


def _of_pose(tips: Tips, geometry: Geometry) -> Iterator[Finding]:
    """Findings on the camera: its lens where one factor explains what is off, or else its pose."""
    if not tips.is_off:
        return
    pose = ", ".join(f"{number:g}" for number in camera_to_fork(tips, geometry))
    move = f"set setup.camera_to_fork: [{pose}] in params.yaml"
    what = (
        f"the camera shows the fork tips {1e3 * tips.off:.1f} ± {1e3 * tips.off_error:.1f} mm off"
    )
    turn = float(np.linalg.norm(tips.turned))
    if turn * tips.reach > MATTERS:
        what += f" and the band turned by {np.degrees(turn):.1f} degrees"
    lens = tips.lens
    if lens is None:
        yield EXTRINSICS.found(what, f"calibrate it again, or {move}")
        return
    factor = f"{lens.factor:.3f} ± {lens.error:.3f}"
    if lens.kind == "depth":
        what += f", as one does whose depth is {factor} times the true one"
        cure = "calibrate its depth (scale or offset)"
    else:
        what += f", as one does that sees all {factor} times as wide as it is"
        cure = "calibrate its focal length (camera_info)"
    yield LENS.found(what, f"{cure}; if that is right, {move}")


def camera_to_fork(tips: Tips, geometry: Geometry) -> list[float]:
    """Pose, in the form of setup, that would put the camera's clouds in their place."""
    believed = geometry.camera @ geometry.color.inverse()
    pose = (tips.correction @ believed).inverse()
    parts = np.array([*pose.translation, *pose.rotation.as_quat(canonical=True)])
    return [round(float(number), 6) for number in parts]
