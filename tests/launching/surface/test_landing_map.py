"""The landing map against the closed form of the toy slingshot."""

import numpy as np

from sling2sim2real.launching.surface.landing_map import OUTSIDE, TOO_MUCH_FORCE, LandingMap
from tests.policy import toy

SIZE = (33, 25)


def simulate(launcher=toy.launch, max_force: float = 1e3) -> LandingMap:
    return LandingMap.simulate(
        launcher, draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, size=SIZE, max_force=max_force
    )


def random_draws(count: int = 500, seed: int = 11) -> np.ndarray:
    low, high = np.array([toy.DRAW_Y, toy.DRAW_Z]).T
    return np.random.default_rng(seed).uniform(low, high, (count, 2))


def broken_beyond(least: float):
    """The toy, but that launches fail from draws whose sum is above `least` [m]."""

    def launch(draws: np.ndarray):
        launched, bad = toy.launch(draws), draws.sum(1) > least
        launched.landing_y[bad] = launched.hold_force[bad] = np.nan
        launched.failure = ["it broke" if failed else None for failed in bad]
        return launched

    return launch


def test_reads_the_closed_form_between_the_nodes() -> None:
    draws = random_draws()
    landed, truth = simulate()(draws), toy.launch(draws)
    assert not landed.failure.any()
    np.testing.assert_allclose(landed.landing_y, truth.landing_y, atol=1e-4)
    np.testing.assert_allclose(landed.hold_force, truth.hold_force, atol=1e-4)


def test_fails_exactly_the_draws_above_the_force_limit() -> None:
    draws, limit = random_draws(), 12.0
    chart = simulate(max_force=limit)
    landed, force = chart(draws), toy.launch(draws).hold_force
    clear = np.abs(force - limit) > 1e-3
    assert 50 < (force > limit).sum() < 450
    np.testing.assert_array_equal(landed.failure[clear] > 0, force[clear] > limit)
    assert {chart.reasons[code] for code in landed.failure} == {"", TOO_MUCH_FORCE}
    assert np.isnan(landed.landing_y[landed.failure > 0]).all()


def test_does_not_read_across_failed_launches() -> None:
    """Launches fail in a corner of the box: no answer there, and full accuracy elsewhere."""
    chart, draws = simulate(broken_beyond(-0.45)), random_draws()
    landed = chart(draws)
    cell = (0.2 / 32 + 0.2 / 24) * 1.001
    beyond = draws.sum(1) > -0.45
    safe = draws.sum(1) < -0.45 - cell
    assert beyond.sum() > 20 and safe.sum() > 300
    assert (landed.failure[beyond] > 0).all() and np.isnan(landed.landing_y[beyond]).all()
    assert not landed.failure[safe].any()
    assert chart.reasons[landed.failure[beyond][0]] == "it broke"
    error = np.abs(landed.landing_y - toy.launch(draws).landing_y)[safe]
    assert error.max() < 0.02 and np.median(error) < 1e-4


def test_refuses_draws_outside_the_box() -> None:
    chart = simulate()
    landed = chart(np.array([[-0.46, -0.2], [-0.3, -0.05], [-0.45, -0.3]]))
    assert [chart.reasons[code] for code in landed.failure] == [OUTSIDE, OUTSIDE, ""]
