"""The force: its noise and zero, and whether it is one that a held band makes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.processed import Processed
from sling2sim2real.recording.release import RUBBER
from sling2sim2real.recording.sensor import QUIET, flat_top

NOISE = DRIFT = 0.02  # of the held force; drift from grasp to release
RELEASE = 0.001  # s
ZERO_OFF, ZERO_UNSURE, ZERO_FAR = 0.01, 0.02, 0.1  # of the held force
SURE = 2.0  # standard errors of the zero that count
SLOW = 0.02  # s: a filter that delays by more makes the whole force late

NOISY = Check(
    "noise",
    "the scatter of the force's samples with the held force",
    "none: thousands of samples tell the scatter",
    f"{100 * NOISE:g} % of the held force",
    "",
    "shield the sensor's cable, stop what shakes the arm",
)
DRIFTS = Check(
    "drift",
    "the free hand's force before the grasp with that after the release",
    "the means' standard errors, some 0.01 N",
    f"{100 * DRIFT:g} % of the held force between grasp and release",
    "",
    "let the sensor warm up for half an hour (a steady drift is taken out)",
)
MOST_FORCE = Check(
    "max_force",
    "the peak force with setup.max_force",
    "the sensor's own",
    "above it",
    "",
    "pull less far, or set in params.yaml what the arm may hold",
)
RELEASED = Check(
    "release",
    "how surely the force's fall tells the time of the release",
    "the fall's standard error",
    f"{1e3 * RELEASE:g} ms",
    "force is missing around the release, or never drops",
    "record the force at 1 kHz, unfiltered: 1 ms is 3 to 4 % of a landing",
)
SLIP = Check(
    "slip",
    "sudden drops of the held force with the release",
    "the force's noise",
    "one before the release",
    "the gripper stays closed at the release",
    "the band slipped in the pads: grip firmly and record again",
)
ZERO = Check(
    "zero",
    "the course of the free hand's force, before the grasp and after the release, with a steady"
    " drift",
    "the means' and slopes' standard errors, by blocks of 50 ms",
    f"the zero moves by {100 * ZERO_OFF:g} % of the held force, but not steadily, or is not known"
    f" to {100 * ZERO_UNSURE:g} %",
    f"{100 * ZERO_FAR:g} %",
    "let the sensor warm up, load it once before; keep the hand free and at rest at both ends",
)
ZEROED = Check(
    "zeroed",
    "sudden changes of the force that last with the free hand's before and after",
    "the force's noise",
    "the sensor was zeroed while recording; the steps are taken out",
    "",
    "zero the sensor before recording",
)
JUMP = Check(
    "jump",
    "sudden changes of the free hand's force before the grasp with its force at the end",
    "the force's noise",
    "one that is neither a knock nor a new zero",
    "",
    "leave the sensor and the hand alone from the start of the recording on",
)
RANGE = Check(
    "range",
    "the force's noise at its peak with the free hand's",
    "thousands of samples tell the scatter",
    "",
    f"below {100 * QUIET:g} % of it at an extreme value",
    "pull less far, or use a sensor of a larger range",
)
FILTER = Check(
    "filter",
    "how long the force falls at the release, and its noise, with an unfiltered sensor's",
    "the time between samples",
    f"{1e3 * RUBBER:g} ms, or three samples where neighbouring ones have the same noise",
    f"{1e3 * SLOW:g} ms",
    "record the sensor's own, unfiltered force",
)
CHECKS = (RANGE, FILTER, NOISY, DRIFTS, ZERO, ZEROED, JUMP, MOST_FORCE, RELEASED, SLIP)


def findings(done: Processed) -> Iterator[Finding]:
    signals, facts = done.signals, done.signals.facts
    hold = float(np.linalg.norm(facts.hold_force))
    yield from _of_sensor(done)
    share = facts.noise / hold
    if share > NOISE:
        what = f"the force's noise is {facts.noise:.2f} N, {100 * share:.0f} % of the hold"
        yield NOISY.found(what)
    pull = signals.release_time - signals.grasp_time
    drifted = float(np.linalg.norm(facts.drift)) * pull
    if drifted > DRIFT * hold:
        yield DRIFTS.found(f"the force drifts by {drifted:.2f} N from grasp to release")
    yield from _of_zero(done, hold)
    most = done.params.setup.max_force
    if facts.peak_force > most:
        what = f"the peak force of {facts.peak_force:.1f} N is above setup.max_force {most:g} N"
        yield MOST_FORCE.found(what)
    if facts.release_error > RELEASE:
        yield RELEASED.found(f"the release is known to ± {1e3 * facts.release_error:.1f} ms")
    for time in facts.slips:
        what = f"the force drops suddenly at {done.start + time:.2f} s, before the release"
        yield SLIP.found(what)


def _of_sensor(done: Processed) -> Iterator[Finding]:
    """Its range and its filter."""
    facts, top = done.signals.facts, flat_top(done.pull)
    if top:
        times = f"{top.begin:.2f} - {top.end:.2f} s"
        what = (
            f"the force stops at {top.value:.1f} N along {'xyz'[top.axis]} of the sensor ({times})"
        )
        what += ", without noise: its range ends there"
        cure = RANGE.remedy
        if top.frozen:
            what = f"the force does not change at all while it is large ({times}): the sensor froze"
            cure = "see why its driver stopped, and record again"
        yield RANGE.found(what, cure, refused=True)
    if facts.filtered:
        what = f"the force takes {1e3 * facts.release_spread:.1f} ms to fall from 9 to 3 tenths:"
        what += " it is filtered, and comes about as late"
        refused = facts.release_spread > SLOW
        yield FILTER.found(what, refused=refused)


def _of_zero(done: Processed, hold: float) -> Iterator[Finding]:
    facts = done.signals.facts
    change = 0.0 if facts.zero_change is None else float(np.linalg.norm(facts.zero_change))
    if not facts.zero_steady and change > ZERO_OFF * hold:
        what = f"the force's zero is {change:.2f} N off after the release, and did not get there"
        what += f" steadily: the held force is unsure by up to {100 * change / hold:.0f} %"
        yield ZERO.found(what, refused=change > ZERO_FAR * hold)
    elif SURE * facts.zero_error > ZERO_UNSURE * hold:
        share = 100 * SURE * facts.zero_error / hold
        what = f"the free hand's force is known to {SURE * facts.zero_error:.2f} N only, which is"
        what += f" {share:.0f} % of the hold"
        yield ZERO.found(what, refused=SURE * facts.zero_error > ZERO_FAR * hold)
    for time in facts.zeroed:
        what = f"the sensor was zeroed at {done.start + time:.2f} s, which is taken out"
        yield ZEROED.found(what)
    for time in facts.jumps:
        what = f"the free hand's force jumps at {done.start + time:.2f} s, before the grasp"
        yield JUMP.found(what)
