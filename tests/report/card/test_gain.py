"""Gains against brute force: joint Gaussians, and least squares over the evidence itself."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.identify.posterior.launches import TAPE
from pipeline.report.card.gain import LandingModel, unknowns
from pipeline.report.card.next_steps import next_steps, relaxing
from pipeline.report.card.verdict import Reason

NAMES = ["youngs_modulus", "elasticity_damping", "returned_share", "air_drag"]
RNG = np.random.default_rng(3)
ROOT = RNG.normal(size=(4, 4)) * 0.05
COVARIANCE = ROOT @ ROOT.T + np.diag([1e-4, 0.05, 2e-4, 0.1])
GRADIENT = np.array([[0.8, -0.2, 1.5, -0.01], [0.9, -0.25, 1.7, -0.02]])


@pytest.fixture
def model() -> LandingModel:
    draw = np.array([0.02, 0.03])
    spread = np.sqrt(np.einsum("td,de,te->t", GRADIENT, COVARIANCE, GRADIENT) + draw**2)
    return LandingModel(NAMES, COVARIANCE, GRADIENT, draw, 1.645 * spread)


def conditioned(covariance, known: list[int], rest: list[int]) -> np.ndarray:
    """Of a joint Gaussian's `rest` given its `known`, by its precision: another way than ours."""
    both = [*rest, *known]
    precision = np.linalg.inv(covariance[np.ix_(both, both)])
    return np.linalg.inv(precision[: len(rest), : len(rest)])


def test_a_launch_narrows_as_the_joint_gaussian_of_landings_says(model) -> None:
    """Landings, and measured ones with errors of their own, as one Gaussian of all."""
    for count in (1, 5):
        rows = np.vstack([GRADIENT, *[GRADIENT[:1]] * count])
        joint = rows @ COVARIANCE @ rows.T
        joint += np.diag([1e-12, 1e-12, *[model.draw[0] ** 2 + TAPE**2] * count])
        left = conditioned(joint, list(range(2, 2 + count)), [0, 1])
        expected = 1.645 * np.sqrt(np.diag(left) + model.draw**2)
        found = model.after(model.launched(0, TAPE, count))
        np.testing.assert_allclose(found, expected, rtol=1e-5)
        assert (found < model.half_width).all()


def test_knowing_some_exactly(model) -> None:
    left = conditioned(COVARIANCE, [1, 3], [0, 2])
    spread = np.einsum("td,de,te->t", GRADIENT[:, [0, 2]], left, GRADIENT[:, [0, 2]])
    expected = 1.645 * np.sqrt(spread + model.draw**2)
    found = model.after(model.exact(["elasticity_damping", "air_drag", "unknown"]))
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_an_exact_arm_leaves_what_the_samples_spread(model) -> None:
    expected = np.sqrt(np.einsum("td,de,te->t", GRADIENT, COVARIANCE, GRADIENT)) * 1.645
    np.testing.assert_allclose(model.after(draw=0.0), expected, rtol=1e-9)


def test_another_pull_counts_its_evidence_twice_and_the_prior_once() -> None:
    """Against a fit to evidence that is there twice."""
    design = RNG.normal(size=(30, 4)) * [5.0, 0.5, 0.001, 0.2]
    told = design.T @ design
    empty = LandingModel(NAMES, np.eye(4), GRADIENT, np.zeros(2), np.ones(2))
    prior = empty._prior()
    assert prior[2, 2] == pytest.approx(0.015**-2)
    model = LandingModel(NAMES, np.linalg.inv(told + prior), GRADIENT, np.zeros(2), np.ones(2))
    twice = np.vstack([design, design])
    expected = np.linalg.inv(twice.T @ twice + prior)
    np.testing.assert_allclose(model.pulled(), expected, rtol=1e-6, atol=1e-12)
    half = np.linalg.inv(1.5 * told + prior)  # of two, one more
    np.testing.assert_allclose(model.pulled(2), half, rtol=1e-6, atol=1e-12)


def test_a_model_is_read_off_samples() -> None:
    """Landings that are exactly linear in the logarithms are given back."""
    centre = np.array([2e5, 2e-3, 1.0, 0.5])
    phi = RNG.multivariate_normal(np.zeros(4), COVARIANCE, size=500)
    samples = np.exp(phi) * centre
    samples[:, 3] = 0.5 + phi[:, 3]  # no logarithm
    samples = np.column_stack([samples, np.full(500, 0.47)])
    some = np.linspace(0, 499, 60).astype(int)
    landings = 1.9 + GRADIENT @ phi[some].T
    aims = SimpleNamespace(
        samples=landings, slope=np.array([0.02, 0.03]), half_width=np.array([0.1, 0.11])
    )
    model = LandingModel.of([*NAMES, "poissons_ratio"], samples, aims)
    assert model.names == NAMES and list(unknowns([*NAMES, "poissons_ratio"], samples)) == NAMES
    np.testing.assert_allclose(model.gradient, GRADIENT, atol=1e-9)
    np.testing.assert_allclose(model.covariance, np.cov(phi.T), atol=1e-9)
    aims.half_width = np.array([np.nan, 0.1])
    assert LandingModel.of([*NAMES, "poissons_ratio"], samples, aims) is None
    assert LandingModel.of([], np.zeros((0, 0)), aims) is None


def still(fall: float) -> SimpleNamespace:
    """A pull of 10 N whose force falls by so much in the last half second."""
    time = np.arange(0, 4, 0.03)
    force = np.zeros((len(time), 3))
    force[:, 1] = 10 - fall * np.clip((time - 2.5) / 0.5, 0, 1)
    return SimpleNamespace(time=time, force=force, release_time=3.0)


def test_a_force_that_still_falls_is_seen() -> None:
    assert relaxing(still(0.5)) and not relaxing(still(0.02))


def test_steps_are_cures_and_then_gains_the_largest_first(model) -> None:
    reasons = [Reason(False, "why", "Do this."), Reason(False, "too", "Do this.")]
    steps = next_steps("toy", reasons, model, np.array([1.7, 1.9]), [still(0.0)])
    assert steps[0] == "Do this." and steps.count("Do this.") == 1
    after = [float(step.split("±")[2].split()[0]) for step in steps[1:]]
    assert len(after) >= 2 and after == sorted(after)
    assert "Measure a launch and tell it with `sling observe --band toy`" in " ".join(steps)
    more = next_steps("toy", reasons, model, np.array([1.7, 1.9]), [still(0.0)], launches=2)
    assert "Measure another launch" in " ".join(more)
    assert "1.9 m" in steps[1]


def test_what_speaks_against_any_use_is_mended_first(model) -> None:
    reasons = [Reason(True, "why", "Do this."), Reason(False, "too", "And that.")]
    asked = "toy", reasons, model, np.array([1.7, 1.9]), [still(0.0)]
    assert next_steps(*asked) == ["Do this.", "And that."]


def test_where_nothing_helps_it_says_so() -> None:
    known = LandingModel(NAMES, 1e-12 * np.eye(4), GRADIENT, np.zeros(2), np.ones(2))
    exact = LandingModel(NAMES, 1e-12 * np.eye(4), GRADIENT, np.full(2, 1e-9), np.ones(2))
    assert next_steps("toy", [], None, np.array([1.7]), [still(0.0)]) == [
        "Nothing more would narrow the landings by much: launch."
    ]
    assert known.after(draw=0.0)[0] == pytest.approx(1.0)
    assert len(next_steps("toy", [], exact, np.array([1.7, 1.9]), [still(0.0)])) >= 1
