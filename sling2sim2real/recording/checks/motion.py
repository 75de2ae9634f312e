"""What the hand does: before the grasp, until the release, and between two pulls."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.processed import Processed
from sling2sim2real.recording.pulls import CALM
from sling2sim2real.recording.release import SETTLE
from sling2sim2real.recording.signals import Signals

ADVISED_LEAD_IN, PAUSE = 0.5, 1.0  # s
SETTLED = 0.02  # of the held force
STILL = 0.005  # m/s
TURN = 2.0  # degrees

LEAD = Check(
    "lead_in",
    "the time before the grasp with what taring the force takes",
    "of the grasp: a message of the gripper",
    f"less than {ADVISED_LEAD_IN:g} s",
    "",
    f"record {ADVISED_LEAD_IN} s or more, the force is tared there",
)
PAUSES = Check(
    "pause",
    "the hand's rest before the release with the time in which rubber settles",
    "of the release: below a millisecond",
    f"less than {PAUSE:g} s, or the force still changes by {100 * SETTLED:g} % in half a second",
    "",
    "pause for 1 to 2 s, until the force has settled",
)
TURNS = Check(
    "turn",
    "the hand's orientation with that of the lead-in, where the tool's weight is not known",
    "the pose's, some 0.1 degrees",
    f"{TURN:g} degrees",
    "5 degrees",
    "keep its orientation, or give setup.tool in params.yaml",
)
REST = Check(
    "rest",
    f"the pictures' beginning with the pull before: a band swings for {CALM:g} s",
    "none that matters",
    f"less than {CALM:g} s after it",
    "",
    f"wait for {CALM:g} s between two pulls",
)
CHECKS = (LEAD, PAUSES, TURNS, REST)


def findings(done: Processed) -> Iterator[Finding]:
    signals = done.signals
    lead = done.start + signals.grasp_time
    if round(lead, 2) < ADVISED_LEAD_IN:
        yield LEAD.found(f"only {lead:.2f} s of the empty hand come before the grasp")
    still, change = pause(signals)
    if still < PAUSE or change > SETTLED:
        what = f"the hand rests for {still:.1f} s before the release"
        if change > SETTLED:
            what += f", and in its last half second the force changes by {100 * change:.1f} %"
        yield PAUSES.found(what)
    turn = float(np.degrees(signals.facts.turn))
    if turn > TURN and done.params.setup.tool is None:
        yield TURNS.found(f"the hand turns by {turn:.1f} degrees, and its weight with it")
    since = done.start - done.pull.force_time[0] + SETTLE
    if done.pull.number > 1 and since < CALM:
        what = f"the pictures begin {since:.1f} s after the pull before, the band may still swing"
        yield REST.found(what, f"wait for {CALM - since:.1f} s longer between two pulls")


def pause(signals: Signals) -> tuple[float, float]:
    """How long the hand rests before the release [s], and the force's relative change in its end.

    The change is that of a straight line through the last half second that the filter leaves clear.
    """
    times, release = signals.time, signals.release_time
    moving = (np.linalg.norm(signals.velocity, axis=1) > STILL) & (times < release - 0.05)
    still = release - float(times[moving][-1]) if moving.any() else release
    late = (times > release - 0.55) & (times < release - 0.05)
    if late.sum() < 3:
        return still, 0.0
    force = np.linalg.norm(signals.force[late], axis=1)
    slope = np.polyfit(times[late], force, 1)[0]
    return still, float(abs(0.5 * slope) / max(force.mean(), 1e-9))
