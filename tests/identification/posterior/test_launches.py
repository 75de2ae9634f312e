"""The evidence of launches in a toy whose landings are a closed form."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.posterior import launches
from sling2sim2real.identification.posterior.launches import (
    CHRONOGRAPH,
    PROTRACTOR,
    TAPE,
    LaunchExpansion,
    LaunchLikelihood,
    Observed,
)
from sling2sim2real.identification.posterior.sampling import truncated_gaussian, without_each
from sling2sim2real.simulator.model import LaunchHistory, LaunchSetup

STEPS = np.array([1e-3, 1e-3])
FORGETFUL = LaunchSetup(0.05, 1.0, 0.0, None, 1e-3, 1.0)


def toy(sling, setup, theta: np.ndarray, draws: np.ndarray, workers: int) -> SimpleNamespace:
    """Logs of landing and speed are linear in both coordinates; none from draws above z = 0."""
    y, z = np.asarray(draws).T
    landing = np.exp(theta @ [1.0, 0.5]) * y**2 * (1 - z)
    speed = np.exp(theta @ [0.5, 0.25]) * -4 * y
    angle = 0.5 - z + theta @ [0.0, 0.1]
    failure = [None if height <= 0 else "no" for height in z]
    return SimpleNamespace(landing_y=landing, speed=speed, angle=angle, failure=failure)


@pytest.fixture(autouse=True)
def closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launches, "launch", toy)


def expanded(*observed: Observed, phi=(0.0, 0.0)) -> LaunchExpansion:
    likelihood = LaunchLikelihood(observed, None, FORGETFUL)
    return likelihood.expand(lambda phi: phi, np.array(phi), STEPS)


def scored(
    launches: LaunchExpansion,
    prior: np.ndarray,
    pull=0.0,
    *,
    low=-9.0,
    widening=1.0,
    spike=0.0,
) -> np.ndarray:
    """Scores without each, of a mode at 0 of launches and of others, which pull it [precision]."""
    hessian = prior + launches.landed.hessian / widening**2
    gradient = pull + launches.landed.gradient / widening**2
    density = SimpleNamespace(
        launches=launches, phi=np.zeros(2), hessian=hessian, gradient=gradient
    )
    spikes = np.array([spike, 0.0])
    bounds = SimpleNamespace(low=np.array([low, -9.0]), high=np.array([9.0, 9.0]), spikes=spikes)
    return without_each(density, bounds, widening)


def test_the_update_is_the_linear_gaussian_one() -> None:
    """Landing y^2 (1 - z) e^(a + b/2): d log = 2/y, -1/(1 - z) by the draw, 1 and 1/2 by a, b."""
    y, z, error, landing = -0.5, -0.2, 0.004, 0.33
    told = expanded(Observed((y, z), error, landing))
    here = y**2 * (1 - z)
    spread = np.hypot(error * np.hypot(2 / y, 1 / (1 - z)), TAPE / landing)
    gap, design = np.log(landing / here) / spread, np.array([1.0, 0.5]) / spread
    assert told.off == pytest.approx([np.log(landing / here)])
    assert told.landed.misfit == pytest.approx(gap**2, rel=1e-3)
    np.testing.assert_allclose(told.landed.hessian, np.outer(design, design), rtol=1e-3)
    np.testing.assert_allclose(told.landed.gradient, gap * design, rtol=1e-3)
    prior = np.diag([4.0, 25.0])
    moved = np.linalg.solve(prior + told.landed.hessian, told.landed.gradient)
    variance = np.array([1 / 4, 1 / 25])
    gain = variance * [1, 0.5] / (variance @ [1, 0.25] + spread**2)  # Kalman's
    np.testing.assert_allclose(moved, gain * np.log(landing / here), rtol=1e-3)


@pytest.mark.parametrize("measured", [(0, 1, 2), (0, 1), (1,), (1, 2)])
def test_landing_speed_and_angle_share_the_error_of_the_draw(measured) -> None:
    """As Kalman has it where the draw is unknown beside a and b: nothing of it is eliminated."""
    y, z, error = -0.5, -0.2, 0.02
    seen = np.array([0.33, 2.1, 0.72])
    given = [seen[k] if k in measured else None for k in range(3)]
    told = expanded(Observed((y, z), error, *given))
    gap = np.array([np.log(0.33 / (y**2 * (1 - z))), np.log(2.1 / (-4 * y)), 0.72 - (0.5 - z)])
    by_coordinates = np.array([[1.0, 0.5], [0.5, 0.25], [0.0, 0.1]])
    by_draw = np.array([[2 / y, -1 / (1 - z)], [1 / y, 0.0], [0.0, -1.0]])
    noise = np.diag(np.square([TAPE / 0.33, CHRONOGRAPH, PROTRACTOR]))
    prior = np.diag([1 / 4, 1 / 25])
    rows = list(measured)
    design = np.hstack([by_coordinates, by_draw])[rows]
    unknown = np.diag([1 / 4, 1 / 25, error**2, error**2])
    innovation = design @ unknown @ design.T + noise[np.ix_(rows, rows)]
    gain = unknown @ design.T @ np.linalg.inv(innovation)
    precision = np.linalg.inv(prior) + told.landed.hessian
    moved = np.linalg.solve(precision, told.landed.gradient)
    np.testing.assert_allclose(moved, (gain @ gap[rows])[:2], rtol=1e-3)
    covariance = (unknown - gain @ design @ unknown)[:2, :2]
    np.testing.assert_allclose(np.linalg.inv(precision), covariance, rtol=1e-3)


def test_a_speed_is_held_against_all_other_launches_and_not_against_its_own_landing() -> None:
    launched = Observed((-0.5, -0.2), 0.001, 0.33, 2.05)
    alone, both = expanded(launched), expanded(launched, Observed((-0.6, -0.1), 0.0, 0.4))
    prior = np.diag([40.0, 250.0])
    assert list(both.launch) == [0, 0, 1]
    others = expanded(Observed((-0.6, -0.1), 0.0, 0.4)).landed
    covariance = np.linalg.inv(prior + others.hessian)
    slope = alone.slopes[:, 1]
    predicted = alone.off[1] - slope @ covariance @ others.gradient
    expected = predicted / np.sqrt(alone.spread[1] ** 2 + slope @ covariance @ slope)
    assert scored(both, prior)[1] == pytest.approx(expected, rel=0.05)


def test_what_is_left_of_launches_at_other_coordinates() -> None:
    """At the expansion its gap; elsewhere the log is linear. One that fails there is left out."""
    failing = Observed((-0.5, 0.2), 0.001, 0.3)
    observed = Observed((-0.5, -0.2), 0.001, 0.31), failing, Observed((-0.6, -0.1), 0.002, 0.4)
    likelihood, told = LaunchLikelihood(observed, None, FORGETFUL), expanded(*observed)
    left = likelihood.remaining(np.array([[0.0, 0.0], [0.1, -0.3]]), told)
    np.testing.assert_allclose(left[0], told.gap[[0, 2]])
    np.testing.assert_allclose(left[1], left[0] + 0.05 / told.spread[[0, 2]])


def test_a_launch_that_fails_at_the_expansion_is_named_and_pulls_nowhere() -> None:
    good, bad = Observed((-0.5, -0.2), 0.001, 0.31), Observed((-0.5, 0.2), 0.001, 0.31)
    alone, both = expanded(good), expanded(good, bad)
    assert both.failed.tolist() == [False, True] and np.isnan(both.off[1])
    for name in ("misfit", "hessian", "gradient"):
        np.testing.assert_allclose(getattr(both.landed, name), getattr(alone.landed, name))


def test_a_finite_difference_that_fails_takes_no_misfit_away(monkeypatch) -> None:
    """Its coordinate alone tells nothing; what landed still counts, and pulls by the others."""

    def fragile(sling, setup, theta, draws, workers) -> SimpleNamespace:
        done = toy(sling, setup, theta, draws, workers)
        done.landing_y = np.where(theta[:, 1] > 0, np.nan, done.landing_y)
        return done

    launched = Observed((-0.5, -0.2), 0.001, 0.31)
    sound = expanded(launched)
    monkeypatch.setattr(launches, "launch", fragile)
    told = expanded(launched)
    assert told.landed.misfit == sound.landed.misfit and not told.failed.any()
    np.testing.assert_array_equal(told.design[:, 0], sound.design[:, 0] * [1, 0])


def test_each_launch_is_of_the_band_that_the_launches_before_it_left(monkeypatch) -> None:
    """A toy that flies shorter by what was drawn before; the order of the table is that of time."""
    recorded = replace(FORGETFUL, history=LaunchHistory(1.0, 0.5, 0.45))

    def softened(sling, setup, theta, draws, workers) -> SimpleNamespace:
        done = toy(sling, setup, theta, draws, workers)
        done.landing_y = done.landing_y * np.exp(-np.array(setup.history.deepest))
        return done

    monkeypatch.setattr(launches, "launch", softened)
    draws = [(-0.3, -0.4), (-0.4, -0.1), (-0.6, -0.1), (-0.4, -0.2)]  # 0.5, 0.41, 0.61, 0.45 m
    observed = [Observed(draw, 0.001, 0.3) for draw in draws]
    likelihood = LaunchLikelihood(observed, None, recorded)
    told = likelihood.expand(lambda phi: phi, np.zeros(2), STEPS)
    seen = [0.45, 0.5, 0.5, np.hypot(0.6, 0.1)]
    assert likelihood.deepest == pytest.approx(seen) and likelihood.after == pytest.approx(seen[-1])
    each = []
    for observation, before in zip(observed, seen, strict=True):
        setup = replace(recorded, history=LaunchHistory(1.0, 0.5, before))
        single = LaunchLikelihood([observation], None, setup)
        each.append(single.expand(lambda phi: phi, np.zeros(2), STEPS))
    np.testing.assert_allclose(told.off, np.concatenate([part.off for part in each]))
    np.testing.assert_allclose(told.design, np.hstack([part.design for part in each]), rtol=1e-9)
    assert told.landed.misfit == pytest.approx(sum(part.landed.misfit for part in each))
    assert np.ptp(told.off) > 0.1


def test_a_launch_is_held_against_what_all_else_predicts() -> None:
    """As Gauss has it when the launch is really left out: here a, b have a prior and another."""
    near, far = Observed((-0.5, -0.2), 0.001, 0.34), Observed((-0.6, -0.1), 0.0, 0.4)
    prior = np.diag([40.0, 250.0])
    both = expanded(near, far)
    scores = scored(both, prior)
    for index, (observation, rest) in enumerate(((near, far), (far, near))):
        others, alone = expanded(rest), expanded(observation)
        covariance = np.linalg.inv(prior + others.landed.hessian)
        slope = alone.design[:, 0]
        predicted = alone.gap[0] - slope @ covariance @ others.landed.gradient
        expected = predicted / np.sqrt(1 + slope @ covariance @ slope)
        assert scores[index] == pytest.approx(expected, rel=0.05)
    assert np.all(np.abs(scored(both, prior, widening=3.0)) < np.abs(scores))
    failed = expanded(near, Observed((-0.5, 0.2), 0.001, 0.31))
    assert np.isnan(scored(failed, prior)[1])


def test_a_launch_is_not_accused_by_values_out_of_bounds() -> None:
    """Without it the others would have a far below 0, where it must not be: a lies at 0 instead."""
    prior, pull = np.diag([400.0, 1e8]), np.array([-80.0, 0.0])  # to a = -0.2 within 0.05
    one = expanded(Observed((-0.5, -0.2), 0.001, 0.30))
    free, bounded = (scored(one, prior, pull, low=low)[0] for low in (-9.0, 0.0))
    spread = np.hypot(1, one.design[0, 0] / 20)
    expected = (one.gap[0] + 0.2 * one.design[0, 0]) / spread
    assert free == pytest.approx(expected, rel=0.05) and free > 2
    assert abs(bounded) < 1


def test_the_densest_landings_are_no_surprise_though_they_lie_at_an_end() -> None:
    """Without it a is 0 for half of all bands, and for the others up to 0.3 or so: all longer."""
    prior = np.diag([0.3**-2, 1e8])
    at_end = expanded(Observed((-0.5, -0.2), 0.001, 0.30))  # as a = 0 has it
    above = expanded(Observed((-0.5, -0.2), 0.001, 0.30 * np.exp(0.7)))
    below = expanded(Observed((-0.5, -0.2), 0.001, 0.30 * np.exp(-0.2)))
    ends = {"low": 0.0, "spike": np.sqrt(np.pi / 2) * 0.3}
    score, longer, shorter = (scored(it, prior, **ends)[0] for it in (at_end, above, below))
    assert abs(score) < 0.2
    rarer = norm.sf(0.7 / 0.3)  # of half of the bands twice as many
    assert longer == pytest.approx(-norm.ppf(rarer / 2), rel=0.1) and shorter < -3


def test_samples_of_a_rectified_prior_lie_at_its_end_as_often_as_it_says() -> None:
    """Half, where the evidence tells nothing; else by the closed form."""
    rng, one = np.random.default_rng(1), np.ones(1)
    spike = np.array([np.sqrt(np.pi / 2) * 0.3])
    free = truncated_gaussian(0 * one, np.diag([0.3**-2]), 0 * one, 9 * one, 4000, rng, spike)
    assert np.mean(free == 0) == pytest.approx(0.5, abs=0.03)
    precision = 0.3**-2 + 0.2**-2  # and evidence of 0.1 within 0.2
    centre = np.array([0.1 / 0.2**2 / precision])
    told = truncated_gaussian(centre, np.diag([precision]), 0 * one, 9 * one, 4000, rng, spike)
    evidence = lambda x: np.exp(-0.5 * ((x - 0.1) / 0.2) ** 2)  # noqa: E731
    x = np.linspace(0, 3, 30_001)
    above = np.trapezoid(evidence(x) * np.exp(-0.5 * (x / 0.3) ** 2), x)
    at_end = evidence(0) * spike[0]
    assert np.mean(told == 0) == pytest.approx(at_end / (at_end + above), abs=0.03)


@pytest.mark.parametrize(
    ("draw", "error", "landing", "words"),
    [
        ((-0.3, -0.1), 0.001, 195, "launch: landing must lie from 0 to 20 m"),
        ((0.3, -0.1), 0.001, 1.9, "launch: draw_y must lie from -20 to 0 m"),
        ((-0.3, -0.1), -1.0, 1.9, "launch: error must lie from 0 to 0.1 m"),
        ((-0.3, float("nan")), 0.001, 1.9, "draw_z must lie"),
    ],
)
def test_no_launch_has_such_a_value(draw, error, landing, words) -> None:
    with pytest.raises(UserError, match=words):
        Observed(draw, error, landing)


@pytest.mark.parametrize(
    ("flown", "words"),
    [
        ({}, "launch: give its landing, its speed, or both"),
        ({"angle": 0.7}, "launch: give its landing, its speed, or both"),
        ({"speed": -5.0}, "launch: speed must lie from 0 to 100 m/s"),
        ({"speed": 5.0, "angle": 35.0}, "launch: angle must lie from -90 to 90 degrees"),
    ],
)
def test_no_launch_left_the_pouch_so(flown, words) -> None:
    with pytest.raises(UserError, match=words):
        Observed((-0.3, -0.1), 0.001, **flown)
