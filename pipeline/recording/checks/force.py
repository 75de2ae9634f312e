"""The force: its noise and zero, and whether it is one that a held band makes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.recording.checks.finding import Check, Finding
from pipeline.recording.processed import Processed

NOISE = DRIFT = 0.02  # of the held force; drift from grasp to release
RELEASE = 0.001  # s

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
CHECKS = (NOISY, DRIFTS, MOST_FORCE, RELEASED, SLIP)


def findings(done: Processed) -> Iterator[Finding]:
    signals, facts = done.signals, done.signals.facts
    hold = float(np.linalg.norm(facts.hold_force))
    share = facts.noise / hold
    if share > NOISE:
        what = f"the force's noise is {facts.noise:.2f} N, {100 * share:.0f} % of the hold"
        yield Finding(NOISY.name, what, NOISY.remedy)
    pull = signals.release_time - signals.grasp_time
    drifted = float(np.linalg.norm(facts.drift)) * pull
    if drifted > DRIFT * hold:
        what = f"the force drifts by {drifted:.2f} N from grasp to release"
        yield Finding(DRIFTS.name, what, DRIFTS.remedy)
    most = done.params.setup.max_force
    if facts.peak_force > most:
        what = f"the peak force of {facts.peak_force:.1f} N is above setup.max_force {most:g} N"
        yield Finding(MOST_FORCE.name, what, MOST_FORCE.remedy)
    if facts.release_error > RELEASE:
        what = f"the release is known to ± {1e3 * facts.release_error:.1f} ms"
        yield Finding(RELEASED.name, what, RELEASED.remedy)
    for time in facts.slips:
        what = f"the force drops suddenly at {done.start + time:.2f} s, before the release"
        yield Finding(SLIP.name, what, SLIP.remedy)
