"""Posterior and profiles of a linear toy, whose Gaussian is known."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.confidence.axes import Axes
from pipeline.confidence.intervals import identifiable, interval
from pipeline.confidence.posterior import batches
from pipeline.confidence.profile import profiles
from pipeline.confidence.residuals import Group
from pipeline.confidence.rounds import LANES
from pipeline.confidence.surrogate import monomials
from pipeline.params.identification import Prior
from tests.confidence.toy import COUNT, GRID, SCALE, SPACE, TRUTH, Toy, ToyResiduals, fitted
from tests.search.toy import episode


def test_posterior_of_a_linear_model(monkeypatch) -> None:
    """Mean and deviations of least squares, from a start that is many deviations off."""
    toy = Toy(seed=1)
    start = TRUTH * [1.03, 0.98, 1.2, 1.05, 0.95]
    posterior = fitted(monkeypatch, toy, episode(), start=start)
    even = toy.axes.even(posterior.samples)
    np.testing.assert_array_less(np.abs(even.mean(axis=0) - toy.optimum), 0.25 * SCALE)
    np.testing.assert_allclose(even.std(axis=0), SCALE, rtol=0.25)
    others = np.corrcoef(even.T) - np.eye(5)
    assert np.abs(others).max() < 0.25
    assert posterior.moved < 0.7


def test_profiles_of_a_linear_model(monkeypatch) -> None:
    """Parabolas, 2.71 at 1.645 deviations; in the damping's case of its product with s."""
    toy = Toy(seed=2)
    posterior = fitted(monkeypatch, toy, episode())
    curves = profiles(posterior, workers=1)
    for name, column in (("youngs_modulus", 0), ("poissons_ratio", 1), ("damping_scale", 4)):
        curve = curves[name]
        scale = SCALE[column] * (TRUTH[0] if column == 0 else 1.0)
        centre = np.exp(toy.optimum[0]) if column == 0 else toy.optimum[column]
        ends = [curve["low"], curve["high"]]
        np.testing.assert_allclose(
            ends, centre + 1.645 * scale * np.array([-1, 1]), atol=0.4 * scale
        )
        low, high = interval(posterior.samples[:, column])
        assert np.ptp(ends) == pytest.approx(high - low, rel=0.15)
        column = posterior.samples[:, column]
        parabola = ((curve["value"] - column.mean()) / column.std()) ** 2
        np.testing.assert_allclose(curve["misfit"], parabola, atol=0.12 * parabola.max())


def test_an_axis_without_effect_is_not_identifiable(monkeypatch) -> None:
    """Friction does nothing: its interval fills what the box leaves, the others stay."""
    scale = np.where(np.arange(5) == 3, np.inf, SCALE)
    toy = Toy(seed=3, scale=scale)
    posterior = fitted(monkeypatch, toy, episode())
    words = {
        name: identifiable(name, *interval(posterior.samples[:, column]), toy.axes)
        for column, name in enumerate(SPACE.names)
    }
    assert not words["dynamic_friction"]
    assert words["youngs_modulus"] and words["poissons_ratio"] and words["damping_scale"]
    even = toy.axes.even(posterior.samples)
    assert even[:, 0].std() == pytest.approx(SCALE[0], rel=0.25)


def test_the_box_cuts_the_posterior(monkeypatch) -> None:
    """The data want a Poisson's ratio beyond the box: samples pile up at its face."""
    toy = Toy(seed=4)
    beyond = (SPACE.high[1] + 0.01 - toy.truth[1]) * toy.columns[:, 1]
    toy.noise = toy.noise + beyond
    posterior = fitted(monkeypatch, toy, episode(), start=np.where(TRUTH == 0.4, 0.47, TRUTH))
    poisson = posterior.samples[:, 1]
    assert poisson.max() <= SPACE.high[1] * (1 + 1e-9)
    assert interval(poisson)[1] > SPACE.high[1] - 0.001
    assert interval(poisson)[0] > SPACE.high[1] - 0.02


def test_an_exponential_prior_moves_posterior_and_profile(monkeypatch) -> None:
    """A Gaussian times exp(-x/mean) is the same Gaussian, variance/mean further down."""
    toy = Toy(seed=5)
    prior = Prior(mean=SCALE[1] / 2, weight=0.0)  # two deviations down, whatever the loss's weight
    axes = Axes(replace(SPACE, priors={"poissons_ratio": prior}), TRUTH)
    posterior = fitted(monkeypatch, toy, episode(), axes=axes)
    poisson, expected = posterior.samples[:, 1], toy.optimum[1] - 2 * SCALE[1]
    assert poisson.mean() == pytest.approx(expected, abs=0.3 * SCALE[1])
    assert poisson.std() == pytest.approx(SCALE[1], rel=0.25)
    curve = profiles(posterior, workers=1)["poissons_ratio"]
    ends = expected + 1.645 * SCALE[1] * np.array([-1, 1])
    np.testing.assert_allclose([curve["low"], curve["high"]], ends, atol=0.4 * SCALE[1])
    parabola = ((curve["value"] - poisson.mean()) / poisson.std()) ** 2
    np.testing.assert_allclose(curve["misfit"], parabola, atol=0.12 * parabola.max())


def test_fixed_parameters_stay(monkeypatch) -> None:
    axes = Axes(SPACE, TRUTH, {"dynamic_friction", "damping_scale"})
    posterior = fitted(monkeypatch, Toy(seed=5), episode(), axes=axes)
    np.testing.assert_array_equal(np.unique(posterior.samples[:, 3:], axis=0), [TRUTH[3:]])


def test_a_residual_in_a_group_of_its_own_does_not_take_over(monkeypatch) -> None:
    """Parameters can bring it to nothing: it must not weigh ever more for that, noise 0.2."""
    own = [
        Group("force_x", phase, 0, rows, GRID[rows])
        for phase, rows in (("taut", np.arange(COUNT - 1)), ("swing", np.array([COUNT - 1])))
    ]
    monkeypatch.setattr(ToyResiduals, "groups", own)
    toy = Toy(seed=8)
    toy.noise[-1] = 0.003  # by chance nearly nothing
    toy.optimum = toy.truth + np.linalg.lstsq(toy.columns, toy.noise, rcond=None)[0]
    posterior = fitted(monkeypatch, toy, episode())
    even = toy.axes.even(posterior.samples)
    assert posterior.moved < 0.7
    np.testing.assert_array_less(np.abs(even.mean(axis=0) - toy.optimum), 0.25 * SCALE)
    assert posterior.last.groups[1]["sigma"] == pytest.approx(0.2 / np.sqrt(2), rel=0.25)


def test_the_same_seed_gives_the_same_samples(monkeypatch) -> None:
    twice = [fitted(monkeypatch, Toy(seed=6), episode(), seed=3).samples for _ in range(2)]
    np.testing.assert_array_equal(*twice)


def test_failures_everywhere_are_one_line(monkeypatch) -> None:
    toy = Toy(seed=7)
    works = toy.interact

    def fails(*arguments):
        rollouts = works(*arguments)
        rollouts.failure = ["it broke"] * len(rollouts.failure)
        return rollouts

    toy.interact = fails
    with pytest.raises(UserError, match="80 of 80 simulations near the best"):
        fitted(monkeypatch, toy, episode())


def test_a_round_has_rollouts_for_all_terms_of_its_surrogate_whatever_its_axes() -> None:
    for axes in range(1, 10):  # θ, the law rubber and the air's drag are 8
        for last in (False, True):
            count = LANES * batches(axes, last)
            terms = monomials(np.zeros((1, axes))).shape[1]
            assert count - 2 * terms >= 0.1 * count
    assert [batches(axes, last) for axes in (1, 5) for last in (False, True)] == [5, 10, 5, 10]
