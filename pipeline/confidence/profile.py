"""Profile curves: the least misfit for each value of one parameter, the others at their best.

The surrogate says where the others are at their best, and what the misfit is; the simulator is run
there and says the same, if all is well. An interval of the profile (misfit below 2.71, the 90 %
point of chi squared) must agree with the posterior's. So the misfit holds what the posterior knows
besides the recording, the tolerances of the instruments and the prior of the drag: a curve does not
go where only an unlikely drag leads. It leaves out the box's prior, which is no knowledge of θ.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.optimize import minimize
from scipy.stats import chi2

from pipeline.confidence.axes import DAMPING, LEAST_SCALE, SCALE
from pipeline.confidence.intervals import LEVEL
from pipeline.confidence.posterior import Posterior
from pipeline.confidence.rounds import LANES

POINTS = 7  # of a curve
WIDER = 0.6  # than the posterior's interval, on each side, as a share of it
CUT = float(chi2.ppf(LEVEL, 1))
FAR = 1e12


def profiles(posterior: Posterior, *, workers: int | None = None) -> dict:
    """Curves of every free parameter.

    Returns:
        {name: {"value": [...], "misfit": [...], "surrogate": [...], "low", "high"}}: physical
        values, -2 log of the profile likelihood, priors but the box's included, by the simulator
        and by the surrogate, 0 at the least, and where the latter is below CUT, within the curve.
    """
    rounds, found = posterior.rounds, posterior.last
    axes, place = rounds.axes, found.place
    curves, even = {}, []
    for column, name in zip(axes.free, axes.names, strict=True):
        values = _grid(posterior.samples[:, column], axes.low[column], axes.high[column])
        best = [_conditional(posterior, int(column), value) for value in values]
        curves[name] = {"value": values}
        even += best
    theta = axes.physical(np.array(even))
    padding = -len(theta) % LANES
    batch = np.concatenate([theta, np.tile(theta[:1], (padding, 1))])
    with ThreadPoolExecutor(workers) as pool:
        rounds.pool = pool
        shifts = np.tile(place.times, (len(batch) // LANES, 1))
        rollouts = rounds.simulate(batch, shifts)
        vectors = np.concatenate(list(pool.map(found.residuals, rollouts)))[: len(theta)]
    failed = np.concatenate([[why is not None for why in one.failure] for one in rollouts])
    z = place.standardised(np.array(even))
    simulated = found.surrogate.least(vectors, found.weight) - 2 * axes.space.log_prior(theta)
    simulated[failed[: len(theta)] | ~np.isfinite(simulated)] = np.inf
    expected = found.misfit(z)
    rough = simulated - expected  # of the simulator, on whatever scale: as far as all share it,
    rough -= np.median(rough[np.isfinite(rough)])  # it is no difference between them
    expected = (expected - expected.min()).reshape(-1, POINTS)
    rough = rough.reshape(-1, POINTS)
    for curve, smooth, more in zip(curves.values(), expected, rough, strict=True):
        low, high = _below(curve["value"], smooth)
        curve |= {"misfit": np.maximum(smooth + more, 0.0), "surrogate": smooth}
        curve |= {"low": low, "high": high}
    return curves


def _grid(samples: np.ndarray, low: float, high: float) -> np.ndarray:
    ends = np.quantile(samples, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    margin = WIDER * np.ptp(ends)
    return np.linspace(max(ends[0] - margin, low), min(ends[1] + margin, high), POINTS)


def _conditional(posterior: Posterior, column: int, value: float) -> np.ndarray:
    """Coordinates (D,) with one parameter at `value` and the others at the surrogate's best."""
    found, axes = posterior.last, posterior.rounds.axes
    gap = np.abs(posterior.samples[:, column] - value)
    nearest = posterior.samples[np.argsort(gap)[:50]]
    rest = np.array([i for i in axes.free if i != column], int)

    def full(some: np.ndarray) -> np.ndarray:
        theta = np.tile(posterior.samples[0], (len(some), 1))
        theta[:, rest] = some
        theta[:, column] = value
        return theta

    def misfit(some: np.ndarray) -> np.ndarray:
        theta = full(some)
        good = axes.inside(theta)
        theta[~good] = nearest[0]
        z = found.place.standardised(axes.even(theta))
        return np.where(good, found.misfit(z), FAR)

    # with the product of damping kept, a change of one of its factors is a small one
    start = nearest.copy()
    if column in (DAMPING, SCALE) and {DAMPING, SCALE} <= set(axes.free.tolist()):
        other = DAMPING + SCALE - column
        product = nearest[:, DAMPING] * nearest[:, SCALE]
        start[:, other] = np.clip(
            product / max(value, LEAST_SCALE if column == SCALE else 1e-9),
            axes.low[other],
            axes.high[other],
        )
    start = start[:, rest]
    if not len(rest):
        return axes.even(full(start[:1]))[0]
    centre = start[np.argmin(misfit(start))]
    scale = posterior.samples[:, rest].std(axis=0) + 1e-12
    simplex = np.concatenate([np.zeros((1, len(rest))), 0.3 * np.eye(len(rest))])
    best = minimize(
        lambda step: float(misfit((centre + step * scale)[None])[0]),
        np.zeros(len(rest)),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 300, "fatol": 0.01, "xatol": 1e-3},
    )
    return axes.even(full((centre + best.x * scale)[None]))[0]


def _below(value: np.ndarray, misfit: np.ndarray) -> tuple[float, float]:
    """Where a curve is below CUT around its least, linear between its points."""
    low = high = int(np.argmin(misfit))
    while low > 0 and misfit[low] < CUT:
        low -= 1
    while high < len(value) - 1 and misfit[high] < CUT:
        high += 1

    def crossing(outer: int, inner: int) -> float:
        rise = misfit[outer] - misfit[inner]
        if misfit[outer] <= CUT or outer == inner:
            return float(value[outer])
        if not np.isfinite(rise):
            return float(value[inner])
        # misfits are nearly parabolas: their roots are nearly straight
        roots = np.sqrt(np.maximum([misfit[inner], CUT, misfit[outer]], 0))
        part = (roots[1] - roots[0]) / (roots[2] - roots[0])
        return float(value[inner] + part * (value[outer] - value[inner]))

    return crossing(low, min(low + 1, high)), crossing(high, max(high - 1, low))
