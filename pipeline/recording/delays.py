"""How late the stamps of pose and camera are against the force's, seen in the recording itself.

A delay is looked for where the hand moves freely, or draws the band: the events are found first,
with the stamps as they were recorded. That they are off by such a delay does no harm, for what is
close to them is left out. Of a pull with other stamps, motion and grasp are estimated anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from pipeline.base.errors import UserError
from pipeline.params import Params
from pipeline.recording.camera_delay import camera_delay
from pipeline.recording.pulls import Pull
from pipeline.recording.tool_inertia import ToolInertia, estimate_tool_inertia

SIGMAS = 3.0  # what is less sure than this is not corrected
MOST_ERROR = 0.003  # s: what is not known better counts as not seen
LEAST_ERROR = 0.0005  # s: what no scatter shows


@dataclass(frozen=True)
class Estimate:
    """By how much a topic's stamps are late.

    Attributes:
        value: Against the force's [s].
        error: Standard deviation [s]; 0 where it was given, None where nothing was seen.
        source: "setup", "estimated" or "not seen".
        applied: Whether the stamps are corrected by it.
    """

    value: float = 0.0
    error: float | None = None
    source: str = "not seen"
    applied: bool = False


@dataclass(frozen=True)
class Delays:
    """Of pose (and twist) and of the camera's two topics; and the tool that told the pose's.

    Attributes:
        tool_inertia: Its `delay` is what `pose` leaves of it, 0 where no more than its error.
    """

    pose: Estimate
    camera: Estimate
    tool_inertia: ToolInertia | None = None


def correct_delays(pull: Pull, params: Params) -> tuple[Pull, Delays]:
    """The pull with the stamps that it should have had, and by what they were late.

    Given delays are taken as they are, when the recording is read; others as far as it shows them.

    The camera's is estimated against the pose, after that was corrected. An estimate is applied
    where it is more than three standard deviations: a wrong correction is worse than none.
    """
    given, late = params.episode.delays, pull.recording.late
    try:
        inertia = estimate_tool_inertia(pull, params.setup.tool)
    except UserError:  # the recording is refused for it later, in its own words
        inertia = None
    pose = _judged(given.pose, lambda: inertia and (inertia.delay, inertia.delay_error))
    shift = pose.value - late.get("pose", 0.0) if pose.applied else 0.0
    if shift:
        pull = pull.shifted(pose=shift)
    if inertia is not None:
        left = inertia.delay - shift
        sure = abs(left) > SIGMAS * max(inertia.delay_error, LEAST_ERROR)
        inertia = replace(inertia, delay=left if sure else 0.0)
    camera = _judged(given.camera, lambda: camera_delay(pull))
    if camera.applied:
        pull = pull.shifted(camera=camera.value - late.get("color", 0.0))
    return pull, Delays(pose, camera, inertia)


def _judged(given: float | None, estimate: Callable[[], tuple[float, float] | None]) -> Estimate:
    if given is not None:
        return Estimate(given, 0.0, "setup", given != 0)
    try:
        found = estimate()
    except UserError:
        return Estimate()
    if found is None:
        return Estimate()
    value, error = found[0], max(found[1], LEAST_ERROR)
    if error > MOST_ERROR:
        return Estimate()
    return Estimate(value, error, "estimated", abs(value) > SIGMAS * error)
