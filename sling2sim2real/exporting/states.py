"""States for which a match holds: what other pauses and earlier draws do to the calibrated band.

Springs have no memory. They are matched to a band that was drawn as far as the recording before,
in the recording's time, and let go after its pause. The band itself relaxes, flows and softens; by
how much it then holds and lands otherwise is computed here, with the calibrated simulation.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.quantities import rounded
from sling2sim2real.simulator.launch import launch

PAUSES = 1 / 3, 3.0, 10.0  # times that of the match
FARTHER = 0.05  # m, of an earlier draw


def state_changes(model: CalibratedBand, draws: np.ndarray) -> list[dict[str, float]]:
    """What other pauses and earlier draws change at draws (N, 2); nothing of a law without memory.

    One entry for each state: the pause from the end of the draw to the release, the farthest
    earlier draw, 0 where there was none, and the largest relative changes over the draws, signed.
    Draws that do not land in either state are left out.
    """
    setup = model.launch_setup
    if setup.history is None:
        return []
    matched = model.launches(draws)
    before = float(np.max(setup.history.deepest))
    states = [{"pause": factor * setup.history.pause} for factor in PAUSES]
    if model.parameters.sample().get("softening"):
        states += [{"deepest": 0.0}, {"deepest": before + FARTHER}]
    changes = []
    for state in states:
        history = replace(setup.history, **state)
        other = launch(model.sling, replace(setup, history=history), model.parameters, draws)
        change = {
            "pause_s": history.pause,
            "drawn_before_m": float(np.max(history.deepest)),
            "hold_force_change": _largest(other.hold_force / matched.hold_force - 1),
            "landing_change": _largest(other.landing_y / matched.landing_y - 1),
        }
        changes.append({name: rounded(value) for name, value in change.items()})
    return changes


def _largest(changes: np.ndarray) -> float:
    """The change (N,) of the largest size; NaN, of draws that do not land, counts as none."""
    finite = changes[np.isfinite(changes)]
    return float(finite[np.abs(finite).argmax()]) if len(finite) else 0.0
