"""Launches in the place of a map: what the simulator says, no more and no less."""

from types import SimpleNamespace

import numpy as np

from sling2sim2real.launching.surface.landing_map import TOO_MUCH_FORCE
from sling2sim2real.launching.surface.simulated import SimulatedLandings
from tests.policy import toy

DRAWS = np.random.default_rng(0).uniform((-0.45, -0.3), (-0.25, -0.1), (200, 2))


def source(launch=toy.launch, max_force: float = 15.0) -> SimulatedLandings:
    setup = SimpleNamespace(draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, max_force=max_force)
    return SimulatedLandings(launch, setup)


def test_it_says_what_the_simulator_does() -> None:
    truth, landings = toy.launch(DRAWS), source()(DRAWS)
    heavy = truth.hold_force > 15.0
    assert 20 < heavy.sum() < 180
    np.testing.assert_array_equal(landings.landing_y[~heavy], truth.landing_y[~heavy])
    np.testing.assert_array_equal(landings.hold_force, truth.hold_force)
    assert np.isnan(landings.landing_y[heavy]).all() and (landings.failure == heavy).all()


def test_failures_keep_their_reasons() -> None:
    """Those that the map never met, too, and before the force that they would have taken."""

    def falling(draws: np.ndarray) -> SimpleNamespace:
        launched = toy.launch(draws)
        launched.failure[:2], launched.failure[-1] = ["it fell"] * 2, "it broke"
        return launched

    some = source(falling, max_force=1e-3)
    failure = some(DRAWS).failure
    names = [some.reasons[code] for code in failure]
    assert names == ["it fell"] * 2 + [TOO_MUCH_FORCE] * 197 + ["it broke"]
    assert (some(DRAWS).failure == failure).all()
