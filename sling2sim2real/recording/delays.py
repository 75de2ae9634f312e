"""How late the stamps of pose and camera are against the force's, seen in the recording itself.

| | seen in | good to |
|---|---|---|
| pose | the tool's inertia, where the sensor feels it | 1 ms |
| pose, against the release | the hand that starts back when the band lets it go | 0.1 ms |
| camera, against the pose | the hand in the pictures | 0.1 ms |
| camera | which picture is the first without the drawn band | a third of a picture's time |

Where the hand starts back with a speed that jumps, its start is known to 1 ms only.

Inertia and hand are looked for where the hand moves freely, or draws the band: the events are found
first, with the stamps as they were recorded. That they are off by such a delay does no harm, for
what is close to them is left out. Of a pull with other stamps, motion and grasp are estimated anew.

A robot that starts back by itself, shortly before or after the release, looks like a late or early
pose: such a delay is taken out only where the camera, tied to the pose by the hand and to the force
by the pictures of the release, confirms it. What nothing confirms, and estimates that contradict
each other, are not used: the pull is refused until `episode.delays` says what it is, for a fit that
looks for it as widely finds another modulus.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.camera_delay import camera_delay
from sling2sim2real.recording.events import Pull
from sling2sim2real.recording.force import ToolInertia, estimate_tool_inertia
from sling2sim2real.recording.release_pictures import ReleasePictures, release_pictures
from sling2sim2real.recording.start_back import start_back
from sling2sim2real.settings import Settings

Found = TypeVar("Found")
SIGMAS = 3.0  # what is less sure than this is not corrected
MOST_ERROR = 0.003  # s: what is not known better counts as not seen
LEAST_ERROR = 0.00005  # s: what no scatter shows
WELL = 0.0005  # s: what is known as well is corrected, though it may be nothing
SMALL = 0.002  # s: less is taken out by one estimate alone
AT_ONCE = 0.04  # s: a hand that starts later does so by itself, not because the band lets it go
UNSEEN_POSE, UNSEEN_CAMERA = 0.003, 0.02  # s: standard deviations where nothing tells
GIVEN_POSE, GIVEN_CAMERA = 0.002, 0.005  # s: of what was given


@dataclass(frozen=True)
class Estimate:
    """Estimate of how late a topic's stamps are.

    Attributes:
        value: Against the force's [s].
        error: Standard deviation of what the recording shows [s], or of what was given where it
            shows nothing; None where nothing was seen or given.
        source: "setup", "estimated" or "not seen".
        applied: Whether the stamps are corrected by it.
        left: Standard deviation of what the stamps may still be late [s].
        against: What the estimate is against: "force"; "release", as the force shows it; or "pose".
        given: What was given of it [s]; None where nothing was.
        alone: Nothing confirms it: only the hand that starts back tells it, as a motion of the
            robot's own would, or another estimate contradicts it. It is not applied.
    """

    value: float = 0.0
    error: float | None = None
    source: str = "not seen"
    applied: bool = False
    left: float | None = None
    against: str = "force"
    given: float | None = None
    alone: bool = False

    @classmethod
    def unseen(cls, given: float | None, error: float, left: float) -> Estimate:
        """Where nothing shows it: as it was given, which is good to `error`, or else `left`."""
        if given is None:
            return cls(left=left)
        return cls(given, error, "setup", given != 0, error, given=given)

    @classmethod
    def seen(
        cls, rest: float, error: float, against: str = "force", given: float | None = None
    ) -> Estimate:
        """What the recording shows, applied where it is sure, or well known and nothing was given.

        Else it is what may be left: a wrong correction is worse than none.
        """
        error = max(error, LEAST_ERROR)
        left = float(np.hypot(error, rest))
        if abs(rest) > SIGMAS * error or (given is None and error < WELL):
            return cls(rest + (given or 0.0), error, "estimated", True, error, against, given)
        if given is None:
            return cls(rest, error, "estimated", False, left, against)
        return cls(given, error, "setup", given != 0, left, against, given)

    @property
    def rest(self) -> float:
        """Correction of the stamps beside what was given [s]."""
        return self.value - (self.given or 0.0) if self.applied else 0.0


@dataclass(frozen=True)
class Delays:
    """Delays of the pose and of the camera's two topics; the tool that showed the pose's.

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


def correct_delays(pull: Pull, params: Settings) -> tuple[Pull, Delays]:
    """The pull with the stamps that it should have had, and by what they were late.

    Given delays are taken off first, when the recording is read; what it shows of the rest is
    estimated as where none was given.

    The camera's is estimated against the pose, after that was corrected, then against the release.
    Where the pictures of the release are off, the hand is looked for from there on.
    """
    given, off = params.episode.delays, pull.recording.late  # what reading it took off already
    pull = pull.shifted((given.pose or 0.0) - off.get("pose", 0.0))
    pull = pull.shifted(camera=(given.camera or 0.0) - off.get("color", 0.0))
    inertia = _or_none(lambda: estimate_tool_inertia(pull, params.setup.tool))
    pose, conflict = _of_pose(pull, inertia, given.pose)
    pull = pull.shifted(pose.rest)
    if inertia is not None:
        left = inertia.delay - pose.rest
        sure = abs(left) > SIGMAS * max(inertia.delay_error, LEAST_ERROR)
        inertia = replace(inertia, delay=left if sure else 0.0)

    def at_the_release(pull: Pull) -> ReleasePictures | None:
        return _or_none(lambda: release_pictures(pull, params.setup.fork_width))

    release = at_the_release(pull)
    by_hand = _by_hand(pull, release)
    camera, allowed = Estimate.unseen(given.camera, GIVEN_CAMERA, UNSEEN_CAMERA), 0.0
    if by_hand is not None:
        camera = Estimate.seen(*by_hand, against="pose", given=given.camera)
        allowed = SIGMAS * (camera.error or 0.0)
    if camera.rest:
        pull = pull.shifted(camera=camera.rest)
        release = at_the_release(pull)
    if pose.alone and release is not None and release.confirms(pose.value, allowed):
        pose = replace(pose, applied=True, left=pose.error, alone=False)
        if by_hand is not None:  # it goes with the pose
            camera = Estimate.seen(camera.rest + pose.value, by_hand[1], "pose", given.camera)
        pull = pull.shifted(pose.value, pose.value if by_hand else 0.0)
        release = at_the_release(pull)
    elif pose.alone and release is not None and release.off(pose.value) > allowed >= release.beyond:
        pose = Estimate(left=UNSEEN_POSE)  # the hand moved by itself
    if release is None:
        return pull, Delays(pose, camera, inertia, release, conflict)
    if by_hand is None and release.beyond:
        pull = pull.shifted(camera=release.middle)
        value, error = (given.camera or 0.0) + release.middle, release.error
        camera = Estimate(value, error, "estimated", True, error, given=given.camera)
    elif by_hand is None:
        around = float(np.hypot(release.middle, release.error))
        camera = replace(camera, left=around if given.camera is None else min(around, GIVEN_CAMERA))
    elif release.beyond > allowed:
        pull = pull.shifted(camera=-camera.rest)
        left = float(np.hypot(camera.rest + release.middle, release.error))
        camera = Estimate.unseen(given.camera, left, left)
        conflict = conflict or (
            "the hand in the pictures goes with the pose, but the band is let go"
            f" {1e3 * release.middle:+.0f} ± {1e3 * release.error:.0f} ms after the force falls"
        )
    return pull, Delays(pose, camera, inertia, release, conflict)


def _by_hand(pull: Pull, release: ReleasePictures | None) -> tuple[float, float] | None:
    """The camera's delay against the pose and its standard error [s]; None where nothing tells.

    Args:
        release: From which on it is looked for.
    """
    near = release.middle if release is not None and release.beyond else 0.0
    matched = _or_none(lambda: camera_delay(pull.shifted(camera=near)))
    return (near + matched[0], matched[1]) if matched and matched[1] <= MOST_ERROR else None


def _of_pose(pull: Pull, inertia: ToolInertia | None, given: float | None) -> tuple[Estimate, str]:
    """The pose's delay, and the conflict of the two that tell it."""
    estimates = []
    if inertia is not None and max(inertia.delay_error, LEAST_ERROR) <= MOST_ERROR:
        estimates.append((inertia.delay, max(inertia.delay_error, LEAST_ERROR)))
    back = _or_none(lambda: start_back(pull))
    if back is not None and abs(back[0]) < AT_ONCE and back[1] <= MOST_ERROR:
        estimates.append(back)
    if not estimates:
        return Estimate.unseen(given, GIVEN_POSE, UNSEEN_POSE), ""
    if len(estimates) == 2:
        (first, its), (other, others) = estimates
        if abs(first - other) > SIGMAS * np.linalg.norm([its, others, pull.release.error]):
            words = (
                f"the pose is {1e3 * first:+.1f} ± {1e3 * its:.1f} ms late by the tool's inertia,"
                f" but {1e3 * other:+.1f} ± {1e3 * others:.1f} ms by the hand that starts back"
            )
            if given is not None:
                return Estimate.unseen(given, GIVEN_POSE, UNSEEN_POSE), words
            left = float(np.hypot(first, its))
            return Estimate(first, its, "estimated", False, left, alone=True), words
    elif given is not None and back is not None and back in estimates:
        if abs(back[0]) > SIGMAS * np.hypot(back[1], GIVEN_POSE):
            words = (
                f"with episode.delays.pose {given:g} s the hand starts back"
                f" {1e3 * back[0]:+.1f} ± {1e3 * back[1]:.1f} ms after the force falls: it moves by"
                " itself, or that delay is wrong"
            )
            return Estimate.unseen(given, GIVEN_POSE, UNSEEN_POSE), words
    weights = np.array([error**-2.0 for _, error in estimates])
    value = float(weights @ [value for value, _ in estimates] / weights.sum())
    error, against = float(weights.sum() ** -0.5), "release" if back in estimates else "force"
    if estimates == [back] and abs(value) > max(SMALL, SIGMAS * error) and given is None:
        left = float(np.hypot(value, error))
        return Estimate(value, error, "estimated", False, left, against, alone=True), ""
    return Estimate.seen(value, error, against, given), ""


def _or_none(estimate: Callable[[], Found | None]) -> Found | None:
    """None where the recording does not show it: it is refused for that later, in its own words."""
    try:
        return estimate()
    except UserError:
        return None
