"""The law `corotated`: a launch and a recorded pull by it, beside the neo-Hookean law."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.simulator import interact, launch
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import COROTATED
from tests.simulator.bands import DRAW, THETA, neo


@pytest.fixture(scope="module")
def corotated(sling):
    return replace(sling, law=COROTATED)


def theta(young: float = THETA[0], **others: float) -> Parameters:
    return Parameters.of(COROTATED, [young, *THETA[1:]], **others)


def test_a_drawn_band_pulls_by_the_law_s_stress(sling, corotated, launch_setup) -> None:
    """Of straight halves that keep their volume: 2 (l - 1 - l^-2 + l^-3/2) over l - l^-2."""
    stretch = sling.drawn(np.linalg.norm(DRAW))
    ratio = 2 * (stretch - 1 - stretch**-2 + stretch**-1.5) / (stretch - stretch**-2)
    ours, plain = (
        launch(band, launch_setup, parameters, DRAW).hold_force[0]
        for band, parameters in ((corotated, theta()), (sling, neo(THETA)))
    )
    assert 1.1 < ratio < 1.5
    assert ours / plain == pytest.approx(ratio, rel=0.02)  # the arm gives way a little more


def test_of_equally_strong_bands_it_holds_less_energy(sling, corotated, launch_setup) -> None:
    plain = launch(sling, launch_setup, neo(THETA), DRAW)
    first = launch(corotated, launch_setup, theta(), DRAW)
    young = THETA[0] * float(plain.hold_force[0] / first.hold_force[0])
    ours = launch(corotated, launch_setup, theta(young), DRAW)
    assert ours.hold_force == pytest.approx(plain.hold_force, rel=0.01)
    assert 0.9 * plain.speed < ours.speed < 0.99 * plain.speed


def test_a_slack_band_is_nearly_the_neo_hookean_one(sling, corotated, episode) -> None:
    """Both have the same E: what hangs before the pull hangs alike."""
    ours, plain = interact(corotated, episode, theta()), interact(sling, episode, neo(THETA))
    assert ours.failure == plain.failure == [None]
    assert ours.center_line[0, 0] == pytest.approx(plain.center_line[0, 0], abs=1e-3)
    assert np.nanmax(ours.force) > 1.05 * np.nanmax(plain.force)
