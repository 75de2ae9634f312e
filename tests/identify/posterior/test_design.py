"""The design of a pull against brute force, the simulator and its own limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest, truncnorm

from pipeline.identify.posterior import design
from pipeline.identify.posterior.coordinates import PRIORS, Coordinates
from pipeline.identify.posterior.design import PullDesign, PullLimits, eliminated, lasts, searched
from pipeline.identify.posterior.likelihood import Tolerances
from pipeline.params import load
from pipeline.params.lab import Dip
from pipeline.simulator.launch import launch
from pipeline.simulator.model import LaunchHistory, LaunchSetup
from tests.project import DEFAULTS

PARAMS = load(DEFAULTS)
LIMITS = PullLimits(0.4, 2.0, 7.3)
ONE_DIP = (Dip(at=1.0, depth=0.1, out_time=1.0, back_time=1.0),)


def test_what_is_left_open_counts_as_correlated_noise() -> None:
    """J' S^-1 J with S written out: white noise, and each nuisance's outer product."""
    rng, has, count = np.random.default_rng(3), Tolerances(), 40
    slopes, force = rng.normal(size=(5, count, 2)), rng.normal(size=(count, 2)).cumsum(axis=0)
    noise = has.force**2 * np.eye(2 * count)
    course = np.linspace(0, 1, count)
    rate = np.gradient(force, 0.03, axis=0).ravel()
    noise += has.pose**2 * np.outer(rate, rate)
    for axis in np.eye(2):
        for size, shape in ((has.bias, np.ones(count)), (has.drift, course)):
            column = size * np.outer(shape, axis).ravel()
            noise += np.outer(column, column)
    j = slopes.reshape(5, -1)
    np.testing.assert_allclose(
        eliminated(slopes, force, 0.03), j @ np.linalg.solve(noise, j.T), rtol=1e-9
    )


@pytest.fixture(scope="module")
def small() -> PullDesign:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(design, "DRAWS", 3)
        return PullDesign.of(
            PARAMS, "least_squares", "band1", (-0.4, 0.0), (4.0, 2.0), 13.0, (1.7, 2.0)
        )


def test_prior_draws_have_the_priors_distributions(small) -> None:
    coordinates: Coordinates = small.coordinates
    assert "softening" in coordinates.names
    phi, precision = design.sampled(coordinates, 500, np.random.default_rng(1))
    assert np.all(phi >= coordinates.low) and np.all(phi <= coordinates.high)
    place = coordinates.names.index
    mean, spread = PRIORS["softening"]
    ends = (0 - mean) / spread, (0.6 - mean) / spread
    drawn = phi[:, place("softening")]
    assert kstest(drawn, truncnorm(*ends, mean, spread).cdf).pvalue > 0.01
    half = 1 / np.var(np.abs(np.random.default_rng(2).normal(size=100_000)))
    for name in ("softening", "flow", "air_drag"):
        assert precision[place(name)] == pytest.approx(half / PRIORS[name][1] ** 2, rel=0.02)
    even = phi[:, place("mooney_share")]
    assert precision[place("mooney_share")] == pytest.approx(1 / np.var(even), rel=0.01)
    assert precision.min() > 0


def test_the_bands_hold_the_force_that_is_told(small) -> None:
    """By the simulator, whose band bends, sags and relaxes."""
    paused = LaunchSetup.of(PARAMS.setup, PARAMS.sling, LaunchHistory(4.0, 2.0))
    paused = replace(paused, arm_stiffness=None, duration=0.001)
    parameters = small.coordinates.parameters(small.phi)
    held = launch(small.sling, paused, parameters, np.array([small.draw])).hold_force
    np.testing.assert_allclose(held, 13.0, rtol=0.12)


def test_a_pull_tells_and_a_dip_tells_more(small) -> None:
    before, paper, dip = small.before, small.variances(()), small.variances(ONE_DIP)
    assert np.all(paper < before) and np.all(dip < paper)
    summary = small.information(ONE_DIP)
    assert np.all(np.linalg.eigvalsh(summary) > -1e-6 * np.abs(summary).max())
    silent = [small.coordinates.names.index(name) for name in ("air_drag", "log_returned_share")]
    assert np.all(summary[:, silent] == 0)


class Toy:
    """Of which it is known which dips are best."""

    draw = (-0.4, 0.0)

    def __init__(self, best: float) -> None:
        self.best = best

    def variances(self, dips) -> np.ndarray:
        gain = sum(np.exp(-(((dip.depth - self.best) / 0.1) ** 2)) * dip.at for dip in dips)
        return np.array([1.0, 2.0]) / (1 + gain)


@settings(deadline=None, max_examples=25)
@given(best=st.floats(0.05, 0.3), spare=st.floats(0.0, 8.0), speed=st.floats(0.1, 1.0))
def test_dips_that_are_found_keep_to_the_limits(best, spare, speed) -> None:
    limits = PullLimits(speed, 2.0, spare)
    tried = []
    dips = searched(Toy(best), limits, lambda dips, variance: tried.append(variance))
    assert len(dips) <= design.MOST_DIPS and lasts(dips) <= spare
    for dip in dips:
        assert 0 < dip.depth < dip.at * 0.4
        assert min(dip.out_time, dip.back_time) >= limits.shortest(dip.depth) - 1e-9
    assert Toy(best).variances(dips).mean() == min(tried)


def test_the_best_depth_is_found() -> None:
    dips = searched(Toy(0.15), LIMITS)
    assert len(dips) == design.MOST_DIPS
    assert [dip.depth for dip in dips] == pytest.approx([0.15] * 3, abs=0.06)
    assert min(dip.at for dip in dips) > 0.9
