"""Landing intervals of a slingshot in closed form, with a stiffness that is not known exactly."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from sling2sim2real.launching.trials.spread import (
    MOST,
    landing_intervals,
    landing_spread,
    shortest,
    smoothed,
)
from sling2sim2real.simulator.launch import CENTRAL_DIFFERENCES_M
from tests.policy import toy

DRAWS = np.array([[-0.35, -0.2], [-0.3, -0.15]])
STIFFNESS = 0.02  # relative deviation: landing goes with it


def launcher(draws: np.ndarray, thetas: np.ndarray | None = None) -> SimpleNamespace:
    """The toy, whose landing is scaled by the first parameter."""
    launched = toy.launch(draws)
    if thetas is not None:
        launched.landing_y = launched.landing_y * thetas[:, 0]
    return launched


def samples(count: int = 200) -> np.ndarray:
    theta = np.full((count, 5), 0.5)
    theta[:, 0] = 1 + STIFFNESS * np.random.default_rng(1).normal(size=count)
    return theta


def test_nine_landings_of_ten_lie_inside() -> None:
    """Of launches whose stiffness and draw vary as they are said to."""
    for error, variation in ((1e-3, 0), (0.0, 1), (1e-3, 1)):
        intervals = landing_intervals(launcher, DRAWS, samples() if variation else None, error)
        rng = np.random.default_rng(2)
        for draw, (low, high) in zip(DRAWS, intervals, strict=True):
            landing = toy.launch(draw + rng.normal(0, error, (4000, 2))).landing_y
            landing = landing * (1 + variation * STIFFNESS * rng.normal(size=4000))
            assert 0.85 < ((landing > low) & (landing < high)).mean() < 0.94


def test_an_interval_holds_the_likely_end_of_a_one_sided_parameter() -> None:
    """As of a rubber that does not soften: a central interval leaves it out."""
    theta = samples()
    theta[:, 0] = 1 - STIFFNESS * np.abs(np.random.default_rng(1).normal(size=len(theta)))
    likeliest = toy.launch(DRAWS).landing_y
    low, high = landing_intervals(launcher, DRAWS, theta, 0.0).T
    assert (low < likeliest).all() and (likeliest < high).all()


def test_a_shortest_interval_and_a_kernel_are_those_of_the_normal() -> None:
    values = norm.ppf((np.arange(2000) + 0.5) / 2000, 3.0, 2.0)
    np.testing.assert_allclose(shortest(values), 3 + 2 * norm.ppf([0.05, 0.95]), atol=0.05)
    inner, kernel = smoothed(values[::20])
    assert inner.mean() == pytest.approx(values[::20].mean())
    assert np.hypot(inner.std(), kernel) == pytest.approx(values[::20].std())


def test_failures_of_the_few_are_left_out_and_of_the_many_are_none() -> None:
    def fragile(share: float):
        def launch(draws, thetas=None):
            launched = launcher(draws, thetas)
            if thetas is not None:
                broken = np.arange(len(draws)) % 20 < 20 * share
                launched.failure = ["it broke" if failed else None for failed in broken]
            return launched

        return launch

    assert np.isfinite(landing_intervals(fragile(0.05), DRAWS, samples(), 0.001)).all()
    assert np.isnan(landing_intervals(fragile(0.25), DRAWS, samples(), 0.001)).all()


def test_an_answer_takes_few_launches() -> None:
    """However many samples there are: `sling aim` answers in seconds."""
    launched = []

    def counted(draws, thetas=None):
        launched.append(len(draws))
        return launcher(draws, thetas)

    spread = landing_spread(counted, DRAWS[:1], samples(2000), 0.001)
    few = spread.interval
    assert sum(launched) == len(CENTRAL_DIFFERENCES_M) + MOST and len(spread.chosen) == MOST
    again = launcher(np.repeat(DRAWS[:1], MOST, axis=0), samples(2000)[spread.chosen])
    np.testing.assert_array_equal(spread.centres[0], again.landing_y)  # it says which they are
    many = np.quantile(toy.launch(DRAWS[:1]).landing_y * samples(2000)[:, 0], [0.05, 0.95])
    np.testing.assert_allclose(few[0], many, rtol=0.02)
