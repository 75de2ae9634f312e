"""The fit finds SciPy's bounded minimum on curves that need no simulator."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.identification.posterior import fit as module
from sling2sim2real.identification.posterior.confidence import misfit_without
from sling2sim2real.identification.posterior.expansion import Expansion
from sling2sim2real.identification.posterior.fit import PASSES, NoFit, fit, widened
from sling2sim2real.identification.posterior.identify import birge_ratio
from sling2sim2real.identification.posterior.launches import LaunchExpansion
from sling2sim2real.identification.posterior.sampling import samples_around
from tests.identification.posterior.toy import SIZE, TIME, Curve, curve, least, slopes, space

TRUE = np.array([8.0, 9.0, 3.0]) * SIZE
START = np.array([7.0, 7.0, 4.0]) * SIZE


def curves(count: int, noise: float = 0.1, seed: int = 0, **options) -> list[Curve]:
    rng = np.random.default_rng(seed)
    return [Curve(curve(TRUE) + rng.normal(0, noise, 40), **options) for _ in range(count)]


def away(result, phi: np.ndarray) -> float:
    """In standard deviations given the other coordinates."""
    return np.abs((result.phi - phi) * np.sqrt(np.diag(result.hessian))).max()


@pytest.mark.parametrize("count", [1, 3])
def test_it_finds_scipys_minimum(count):
    seen, box = curves(count), space()
    result = fit(seen, box, START)
    best = least(seen, box, START)
    assert result.settled and away(result, best) < 0.05
    assert len(result.expansions) == count and result.nuisances.shape == (count, 3)
    np.testing.assert_allclose(
        result.hessian, sum(expansion.hessian for expansion in result.expansions)
    )


def test_a_bound_holds_the_mode_and_the_others_give_way(monkeypatch):
    """A minimum beyond zero: at zero, and the rest where SciPy's bounded minimum has it."""
    monkeypatch.setattr(module, "SETTLED_SIZE", 0.05)
    seen = [Curve(curve(np.array([8.0, 9.0, -0.5]) * SIZE))]
    box = space()
    result = fit(seen, box, START)
    assert result.settled and result.phi[2] == 0.0 and result.gradient[2] < 0
    assert away(result, least(seen, box, START)) < 0.05
    assert all(np.all(phi >= 0) for phi in seen[0].requested)


def test_samples_lie_around_the_mode_and_fall_off_from_a_bound():
    """What a settled fit left of its last step moves none; what leads out of bounds does."""
    box, result = space(), fit(curves(1), space(), START)

    def drawn(phi: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        at = replace(result, phi=phi, gradient=gradient)
        return samples_around(widened(at, box, 1.0), box, np.random.default_rng(0))

    left = np.sqrt(np.diag(result.hessian))
    np.testing.assert_array_equal(drawn(result.phi, left), drawn(result.phi, 0 * left))
    ends = result.phi * [1, 1, 0], np.array([0, 0, -4]) * left
    flat, steep = (drawn(ends[0], slope)[:, 2].mean() for slope in (0 * left, ends[1]))
    assert 0 < steep < flat / 2


def test_a_prior_pulls_as_far_as_scipy_says():
    seen, box = curves(1, sigma=1.0), space(expected=np.array([8.0, 15.0, 3.0]), spread=0.5)
    result, free = fit(seen, box, START), fit(seen, space(), START)
    assert away(result, least(seen, box, START)) < 0.05
    assert result.phi[1] > free.phi[1] + 2 * SIZE[1]
    gap = result.phi - box.expected
    assert result.misfit == pytest.approx(
        result.expansions[0].misfit + np.sum(gap**2 * box.precision)
    )


def test_launches_count_as_a_recording_does():
    first, second = curves(2)
    result = fit([first], space(), START, launches=Launches(second))
    assert away(result, least([first, second], space(), START)) < 0.05


class Launches:
    """A curve's samples as launches, which fail where `fails` says so; it keeps what it told."""

    def __init__(self, of: Curve, fails=lambda phi: False) -> None:
        self.of, self.fails, self.told = of, fails, []

    def expand(self, points, phi, steps) -> LaunchExpansion:
        left, change, count = self.of.seen - curve(phi), slopes(phi), np.arange(40)
        if self.fails(phi):
            left, change = np.full_like(left, np.nan), 0 * change
        spread, white = np.full(40, self.of.sigma), np.eye(40) / self.of.sigma
        self.told.append(LaunchExpansion(left, change, spread, white, count))
        return self.told[-1]


def test_a_step_into_failing_launches_is_taken_shorter():
    """As one into a recording's failure: what they no longer cost is no reward."""
    first, second = curves(2)
    fit([first], space(), START, launches=Launches(second))
    there, again = first.requested[1], curves(2)[0]
    launches = Launches(second, lambda phi: np.allclose(phi, there, atol=0.2 * SIZE))
    result = fit([again], space(), START, launches=launches)
    assert launches.told[1].failed.all()
    assert not result.launches.failed.any()
    assert away(result, least([first, second], space(), START)) < 0.05
    went, goes = (np.linalg.norm((again.requested[k] - START) / SIZE) for k in (1, 2))
    assert goes < 0.8 * went


def test_launches_that_fail_at_the_start_count_once_they_land(monkeypatch):
    monkeypatch.setattr(module, "SETTLED_SIZE", 0.02)
    first, second = curves(2)
    launches = Launches(second, lambda phi: phi[1] < 8 * SIZE[1])
    result = fit([first], space(), START, launches=launches)
    assert launches.told[0].failed.all() and not result.launches.failed.any()
    assert away(result, least([first, second], space(), START)) < 0.05


def test_the_fit_keeps_the_launches_of_its_mode():
    """Not those of a step that was tried last and did not get nearer."""
    first, second = curves(2)
    launches = Launches(second)
    result = fit([first], space(), START, launches=launches)
    np.testing.assert_array_equal(result.launches.off, second.seen - curve(result.phi))


def test_a_step_into_failure_is_taken_shorter():
    """From START the first step goes where the simulation fails; the minimum does not."""
    free = curves(1)
    fit(free, space(), START)
    first = free[0].requested[1]
    seen = curves(1, fails=lambda phi: np.allclose(phi, first, atol=0.2 * SIZE))
    result = fit(seen, space(), START)
    assert away(result, least(seen, space(), START)) < 0.05
    assert (
        np.allclose(seen[0].requested[1], first)
        and len(seen[0].requested) > len(free[0].requested) - 1
    )
    went, goes = (np.linalg.norm((seen[0].requested[k] - START) / SIZE) for k in (1, 2))
    assert goes < 0.8 * went  # at once, not by and by


def test_a_start_that_fails_says_so():
    with pytest.raises(NoFit, match="toy: the simulation at the start of the fit fails: it broke"):
        fit(curves(1, fails=lambda phi: True), space(), START)


def test_it_settles_only_where_the_steps_end(monkeypatch):
    assert fit(curves(1), space(), START).settled
    monkeypatch.setattr(module, "ITERATIONS", 2)
    monkeypatch.setattr(module, "PASSES", 1)
    cut = fit(curves(1), space(), START)
    assert not cut.settled and cut.steps == 3


def test_it_is_not_settled_where_it_is_stuck():
    """Everything but its start fails: its damped steps get short, and the minimum stays away."""
    stuck = fit(curves(1, fails=lambda phi: not np.allclose(phi, START)), space(), START)
    assert not stuck.settled and stuck.steps < module.ITERATIONS
    np.testing.assert_array_equal(stuck.phi, START)


def test_each_pass_sorts_the_points_into_bins_once(monkeypatch):
    """Or misfits of different densities would be compared."""
    monkeypatch.setattr(module, "SETTLED_SIZE", 1e-3)
    seen = curves(1)
    fit(seen, space(), START)
    begun = [number for number, kept in enumerate(seen[0].retained) if kept is None]
    assert begun[0] == 0 and 2 <= len(begun) <= PASSES and len(begun) < len(seen[0].retained) / 2
    which = np.cumsum([kept is None for kept in seen[0].retained])
    for kept, begins in zip(seen[0].retained, which, strict=True):
        assert kept is None or kept.number == begun[begins - 1] + 1


def test_within_a_pass_no_step_to_a_greater_misfit_is_taken():
    """Though the first one would lead there: slopes that promise too much."""
    (seen,) = curves(1)
    steep = Steep(seen.seen)
    told = []
    result = fit([steep], space(), START, progress=told.append)
    assert np.all(np.diff([density.misfit for density in told]) < 1e-9)
    assert away(result, least([seen], space(), START)) < 0.2


class Steep(Curve):
    """Slopes far too flat at the start: the first step goes too far."""

    def expand(self, points, phi, *others) -> Expansion:
        result = super().expand(points, phi, *others)
        return replace(result, slopes=result.slopes / 30) if len(self.requested) == 1 else result


def test_what_the_loss_factor_does_to_the_force_moves_the_others_as_if_it_were_known():
    """Of two coordinates the second one's slope does not count: the mode has the first at r = 0."""

    class Partly(Curve):
        def expand(self, points, phi, *others) -> Expansion:
            result = super().expand(points, phi, *others)
            uncounted = result.slopes[:, 1].copy()
            return replace(result, slopes=result.slopes * [1, 0, 1], uncounted=uncounted)

    seen, box = Partly(curve(TRUE)), space(expected=9.5, spread=1.0)
    box = replace(box, precision=box.precision * [0, 1, 0])
    result = fit([seen], box, START)
    assert result.settled and result.phi[1] == pytest.approx(9.5 * SIZE[1])
    rest = np.exp(-0.1 * 9.5 * TIME)
    best = np.linalg.lstsq(np.stack([rest, np.ones_like(rest)], axis=1), seen.seen, rcond=None)[0]
    np.testing.assert_allclose(result.phi[[0, 2]], best * SIZE[[0, 2]], rtol=2e-3)


def test_priors_are_not_widened_by_what_recordings_disagree():
    box = space(expected=np.array([8.0, 15.0, 3.0]), spread=0.5)
    result = fit(curves(2), box, START)
    wide = widened(result, box, 1e6)
    np.testing.assert_allclose(wide.hessian, np.diag(box.precision), rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(
        wide.phi + np.linalg.solve(wide.hessian, wide.gradient), box.expected, rtol=1e-6
    )


def test_finite_differences_stay_within_the_upper_bounds():
    box = space(high=(8.0, 50.0, 50.0))
    assert np.all(box.differences(box.high) == -SIZE)
    assert np.all(box.differences(box.low) == SIZE)


def test_without_a_recording_is_a_fit_without_it():
    """To first order: recordings that differ by as much as their noise."""
    seen, box = curves(3), space()
    result, refit = fit(seen, box, START), fit(seen[1:], box, START)
    more = misfit_without(SimpleNamespace(fit=result, coordinates=box), 0)
    there = seen[0].expand(None, refit.phi, None, None, None).misfit
    assert more == pytest.approx(there - result.expansions[0].misfit, abs=0.3)


def test_disagreement_is_one_of_alike_recordings_and_grows_with_a_shift():
    alike = [Curve(curve(TRUE)) for _ in range(3)]
    assert birge_ratio(fit(alike, space(), START), space()) == 1.0
    assert birge_ratio(fit(alike[:1], space(), START), space()) == 1.0
    ratios = []
    for shift in (0.2, 0.4):
        other = [*alike[:2], Curve(curve(TRUE + shift * SIZE))]
        ratios.append(birge_ratio(fit(other, space(), START), space()))
    assert ratios[0] > 1.5 and ratios[1] == pytest.approx(2 * ratios[0], rel=0.1)


def test_recordings_that_all_want_the_same_beyond_a_bound_do_not_disagree():
    box = space(low=(0.0, 0.0, 5.0))  # of 3
    result = fit([Curve(curve(TRUE)) for _ in range(3)], box, np.array([7.0, 7.0, 6.0]) * SIZE)
    assert result.phi[2] == box.low[2] and result.gradient[2] < -10 / SIZE[2]
    assert birge_ratio(result, box) == 1.0


def test_disagreement_of_mere_noise_is_one_on_average():
    """Chi squared over its degrees of freedom, whatever the noise's seed."""
    squares = []
    for seed in range(200):
        first = fit(curves(3, seed=seed), space(), TRUE)
        total = freedom = 0.0
        for expansion in first.expansions:
            inverse = np.linalg.inv(expansion.hessian)
            total += expansion.gradient @ inverse @ expansion.gradient
            freedom += 3 * (1 - 1 / 3)
        squares.append(total / freedom)
        assert birge_ratio(first, space()) == pytest.approx(
            max(np.sqrt(squares[-1]), 1.0), rel=0.25
        )
    assert np.mean(squares) == pytest.approx(1.0, abs=0.15)
