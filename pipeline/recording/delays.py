"""How late the stamps of pose and camera are against the force's, seen in the recording itself.

| | seen in | good to |
|---|---|---|
| pose | the tool's inertia, where the sensor feels it | 1 ms |
| pose | the hand that starts back when the band lets it go | 1 ms |
| camera, against the pose | the hand in the pictures | 0.5 ms |
| camera | which picture is the first without the drawn band | a third of a picture's time |

Inertia and hand are looked for where the hand moves freely, or draws the band: the events are found
first, with the stamps as they were recorded. That they are off by such a delay does no harm, for
what is close to them is left out. Of a pull with other stamps, motion and grasp are estimated anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from pipeline.base.errors import UserError
from pipeline.params import Params
from pipeline.recording.camera_delay import camera_delay
from pipeline.recording.pulls import Pull
from pipeline.recording.release_pictures import ReleasePictures, release_pictures
from pipeline.recording.start_back import start_back
from pipeline.recording.tool_inertia import ToolInertia, estimate_tool_inertia

Found = TypeVar("Found")
SIGMAS = 3.0  # what is less sure than this is not corrected
MOST_ERROR = 0.003  # s: what is not known better counts as not seen
LEAST_ERROR = 0.0005  # s: what no scatter shows
AT_ONCE = 0.04  # s: a hand that starts later does so by itself, not because the band lets it go
UNSEEN_POSE, UNSEEN_CAMERA = 0.003, 0.02  # s: standard deviations where nothing tells


@dataclass(frozen=True)
class Estimate:
    """By how much a topic's stamps are late.

    Attributes:
        value: Against the force's [s].
        error: Standard deviation [s]; 0 where it was given, None where nothing was seen.
        source: "setup", "estimated" or "not seen".
        applied: Whether the stamps are corrected by it.
        left: Standard deviation of what the stamps may still be late [s]; None where it was given.
        against: Whose stamps the estimate is against, "force" or "pose".
    """

    value: float = 0.0
    error: float | None = None
    source: str = "not seen"
    applied: bool = False
    left: float | None = None
    against: str = "force"

    @classmethod
    def seen(cls, value: float, error: float, against: str = "force") -> Estimate:
        """Applied where it is sure; else it is what may be left."""
        error = max(error, LEAST_ERROR)
        applied = abs(value) > SIGMAS * error
        left = error if applied else float(np.hypot(error, value))
        return cls(value, error, "estimated", applied, left, against)


@dataclass(frozen=True)
class Delays:
    """Of pose (and twist) and of the camera's two topics; and the tool that told the pose's.

    Attributes:
        tool_inertia: Its `delay` is what `pose` leaves of it, 0 where no more than its error.
        release: What the pictures around the release show, before the camera's stamps were
            corrected by them.
        conflict: Of two estimates, in words; "" where they agree.
    """

    pose: Estimate
    camera: Estimate
    tool_inertia: ToolInertia | None = None
    release: ReleasePictures | None = None
    conflict: str = ""


def correct_delays(pull: Pull, params: Params) -> tuple[Pull, Delays]:
    """The pull with the stamps that it should have had, and by what they were late.

    Given delays are taken as they are, when the recording is read; others as far as it shows them.

    The camera's is estimated against the pose, after that was corrected, then against the release.
    An estimate is applied where it is more than three standard deviations, or where the pictures of
    the release cannot be without it: a wrong correction is worse than none.
    """
    given, late = params.episode.delays, pull.recording.late
    inertia = _or_none(lambda: estimate_tool_inertia(pull, params.setup.tool))
    conflict = ""
    if given.pose is not None:
        pose = Estimate(given.pose, 0.0, "setup", given.pose != 0)
    else:
        pose, conflict = _of_pose(pull, inertia)
    shift = pose.value - late.get("pose", 0.0) if pose.applied else 0.0
    if shift:
        pull = pull.shifted(pose=shift)
    if inertia is not None:
        left = inertia.delay - shift
        sure = abs(left) > SIGMAS * max(inertia.delay_error, LEAST_ERROR)
        inertia = replace(inertia, delay=left if sure else 0.0)
    if given.camera is not None:
        camera = Estimate(given.camera, 0.0, "setup", given.camera != 0)
        if camera.applied:
            pull = pull.shifted(camera=camera.value - late.get("color", 0.0))
        release = _or_none(lambda: release_pictures(pull, params.setup.fork_width))
        return pull, Delays(pose, camera, inertia, release, conflict)
    camera = Estimate(left=UNSEEN_CAMERA)
    found = _or_none(lambda: camera_delay(pull))
    if found is not None and found[1] <= MOST_ERROR:
        camera = Estimate.seen(*found, against="pose")
    if camera.applied:
        pull = pull.shifted(camera=camera.value)
    release = _or_none(lambda: release_pictures(pull, params.setup.fork_width))
    if release is not None and release.beyond > SIGMAS * (camera.error or 0.0):
        if camera.source == "estimated":
            off = f"{1e3 * release.middle:+.0f} ± {1e3 * release.error:.0f} ms"
            conflict = conflict or (
                f"the hand in the pictures goes with the pose, but the band is let go {off} after"
                " the force falls"
            )
        value = release.middle + (camera.value if camera.applied else 0.0)
        camera = Estimate(value, release.error, "estimated", True, release.error)
        pull = pull.shifted(camera=release.middle)
    elif release is not None and camera.source != "estimated":
        camera = replace(camera, left=float(np.hypot(release.middle, release.error)))
    return pull, Delays(pose, camera, inertia, release, conflict)


def _of_pose(pull: Pull, inertia: ToolInertia | None) -> tuple[Estimate, str]:
    """The pose's delay, and the conflict of the two that tell it."""
    found = []
    if inertia is not None and max(inertia.delay_error, LEAST_ERROR) <= MOST_ERROR:
        found.append((inertia.delay, max(inertia.delay_error, LEAST_ERROR)))
    back = _or_none(lambda: start_back(pull))
    if back is not None and abs(back[0]) < AT_ONCE and back[1] <= MOST_ERROR:
        found.append(back)
    if not found:
        return Estimate(left=UNSEEN_POSE), ""
    if len(found) == 2:
        (one, its), (other, others) = found
        if abs(one - other) > SIGMAS * np.hypot(its, others):
            words = (
                f"the pose is {1e3 * one:+.1f} ± {1e3 * its:.1f} ms late by the tool's inertia, but"
                f" {1e3 * other:+.1f} ± {1e3 * others:.1f} ms by the hand that starts back"
            )
            return Estimate.seen(one, its), words
    weights = np.array([error**-2.0 for _, error in found])
    value = float(weights @ [value for value, _ in found] / weights.sum())
    return Estimate.seen(value, float(weights.sum() ** -0.5)), ""


def _or_none(estimate: Callable[[], Found | None]) -> Found | None:
    """None where the recording does not show it: it is refused for that later, in its own words."""
    try:
        return estimate()
    except UserError:
        return None
