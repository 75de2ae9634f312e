"""What other pauses and earlier draws change, against what the law says of a held band."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real import LaunchHistory, Theta
from sling2sim2real.exporting.match import proof_draws
from sling2sim2real.exporting.states import FARTHER, PAUSES, state_changes

DRAWN = 0.40  # m, before


@pytest.fixture(scope="module")
def soft(model):
    theta = replace(model.theta, softening=0.3)
    return replace(model, theta=theta, history=LaunchHistory(4.0, 2.0, deepest=DRAWN))


def test_a_longer_pause_relaxes_a_share_for_each_decade(model) -> None:
    """`relaxation` is the share of the stress after 10 s that a decade of time takes."""
    changes = state_changes(model, proof_draws(model))
    assert [change["pause_s"] for change in changes] == pytest.approx(
        [factor * 2.0 for factor in PAUSES], rel=1e-2
    )
    shorter, _, tenfold = (change["hold_force_change"] for change in changes)
    # A pull of 4 s before makes a pause of 2 s rather 4 s, and one of 20 s rather 22 s.
    decades = np.log10(22 / 4)
    assert tenfold == pytest.approx(-model.theta.relaxation * decades, rel=0.3)
    assert shorter > 0 > tenfold
    assert changes[2]["landing_change"] < 0 < changes[0]["landing_change"]


def test_an_earlier_draw_softens_and_a_first_one_does_not(soft) -> None:
    *_, first, farther = state_changes(soft, proof_draws(soft))
    assert first["drawn_before_m"] == 0 and first["landing_change"] > 0
    assert farther["drawn_before_m"] == pytest.approx(DRAWN + FARTHER)
    assert farther["landing_change"] < 0 and farther["hold_force_change"] < 0


def test_a_law_without_memory_has_one_state(model) -> None:
    theta = Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6)
    assert state_changes(replace(model, theta=theta), np.array([[-0.3, -0.15]])) == []
