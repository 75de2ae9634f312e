"""Samples of the density where it is no Gaussian: rollouts around its mode, and weights.

    log p(phi) = -1/2 |r(phi)|^2 + prior + constant

r is what nuisances leave of the residuals (`Likelihood.remaining`). A batch of rollouts, of the
Gaussian at the mode, fits r as a quadratic polynomial of phi: a response surface (Box and Wilson,
J. R. Stat. Soc. B 13, 1951), of which differential evolution (ter Braak, Stat. Comput. 16, 2006)
draws samples. The next batch is simulated there. Its importance weights take out what the surface
gets wrong, and say by how much: N weighted samples are worth (sum w)^2 / sum w^2 of even weight
(Kish, Survey Sampling, 1965). Where that is little, the surface is fitted to that batch too, and
so on. A rectified coordinate (coordinates.py) is sampled below its parameter's end too, where r is
what it is at that end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import RandomState  # emcee's
from scipy.special import ndtr, ndtri

from sling2sim2real.identification.posterior.coordinates import LOSS, Coordinates
from sling2sim2real.identification.posterior.fit import Fit, widened
from sling2sim2real.identification.posterior.launches import LaunchLikelihood
from sling2sim2real.identification.posterior.likelihood import Likelihood

SAMPLES = 200  # of a batch, and of the density
BATCHES = 5  # at most
ENOUGH_EFFECTIVE = SAMPLES / 2  # effective ones
PROPOSAL_WIDTH = 1.2  # than the Gaussian at the mode, of the first batch: its tails are seen too
SURFACE_TEMPER = 0.3  # power of the density, by which a rollout counts for the surface
SURFACE_RIDGE = 1e-2  # of the terms of second order
CHAIN_STEPS = 300  # of the chains, which start at the last batch: some six autocorrelation times
GIBBS_SWEEPS = 250  # of chains that begin at the centre
LEFT_SAMPLES = 2000  # by which a launch is judged that is left out
LEFT_SMOOTHING, LEFT_PLACES = 0.2, 801  # of its predictions, in their deviations; and on a grid
LEAST_LEFT = 1e-6  # of a coordinate's precision
TAIL_END = 8.0  # standard deviations, where a tail has no numbers left


@dataclass(frozen=True)
class Remaining:
    """Residuals that nuisances leave of all evidence around a fit, in standard deviations.

    Attributes:
        recordings, launches: As they were fitted.
        workers: Threads; they change no result.
    """

    fitted: Fit
    coordinates: Coordinates
    recordings: Sequence[Likelihood]
    launches: LaunchLikelihood | None
    workers: int

    def __call__(self, phi: np.ndarray) -> np.ndarray:
        """Those at coordinates (N, D), shape (N, R); NaN where a simulation fails."""
        phi = self.coordinates.rectified(phi)
        fitted, parameters, loss = self.fitted, self.coordinates.parameters(phi), phi[:, LOSS]
        residuals = [
            recording.remaining(parameters, expansion, nuisances, loss, self.workers)
            for recording, expansion, nuisances in zip(
                self.recordings, fitted.expansions, fitted.nuisances, strict=True
            )
        ]
        if self.launches and fitted.launches:
            residuals.append(self.launches.remaining(parameters, fitted.launches))
        return np.concatenate(residuals, axis=1)


def log_density(
    coordinates: Coordinates, phi: np.ndarray, misfit: np.ndarray, widened: float
) -> np.ndarray:
    """Logarithm of the density at N coordinates by their misfits (N,), NaN for a failure.

    Args:
        widened: By what the evidence's standard deviations are multiplied.
    """
    prior = (phi - coordinates.expected) ** 2 @ coordinates.precision
    value = -0.5 * (np.nan_to_num(misfit, nan=np.inf) / widened**2 + prior)
    inside = np.all((phi >= coordinates.lowest) & (phi <= coordinates.high), axis=1)
    return np.where(inside, value, -np.inf)


def samples_around(density: Fit, coordinates: Coordinates, rng: np.random.Generator) -> np.ndarray:
    """SAMPLES of a Gaussian around a mode, PROPOSAL_WIDTH times as wide, within bounds.

    Args:
        density: As `widened` gives it.

    Returns:
        Shape (SAMPLES, D).
    """
    box = coordinates.low, coordinates.high
    centre = density.phi + np.linalg.solve(density.hessian, density.gradient)
    return truncated_gaussian(centre, density.hessian / PROPOSAL_WIDTH**2, *box, SAMPLES, rng)


def truncated_gaussian(
    centre: np.ndarray,
    precision: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    count: int,
    rng: np.random.Generator,
    spikes: np.ndarray | None = None,
) -> np.ndarray:
    """Samples (count, D) of the density exp(-(x - centre)' precision (x - centre) / 2) in a box.

    By Gibbs: each coordinate given the others, cut off (Robert, Stat. Comput. 5, 1995).

    Args:
        centre: Maximum of the unbounded Gaussian (D,), which may lie outside the box.
        precision: Positive definite, (D, D).
        spikes: `Coordinates.spikes`, where the box's low ends have such.
    """
    spread = 1 / np.sqrt(np.diag(precision))
    chains = np.tile(np.clip(centre, low, high), (count, 1))
    for _ in range(GIBBS_SWEEPS):
        for axis, deviation in enumerate(spread):
            pull = (chains - centre) @ precision[axis] - precision[axis, axis] * (
                chains[:, axis] - centre[axis]
            )
            mean = centre[axis] - pull * deviation**2
            ends = [
                ((end[axis] - mean) / deviation).clip(-TAIL_END, TAIL_END) for end in (low, high)
            ]
            below, above = map(ndtr, ends)
            part = below + rng.random(count) * (above - below)
            tail = np.where(above > below, ndtri(np.clip(part, 1e-16, 1 - 1e-16)), ends[0])
            chains[:, axis] = np.clip(mean + deviation * tail, low[axis], high[axis])
            if spikes is not None and spikes[axis]:
                inside = deviation * np.sqrt(2 * np.pi) * (ndtr(-ends[0]) - ndtr(-ends[1]))
                at_end = spikes[axis] * np.exp(-0.5 * ends[0] ** 2)
                chains[rng.random(count) * (at_end + inside) < at_end, axis] = low[axis]
    return chains


def without_each(density: Fit, coordinates: Coordinates, widening: float = 1.0) -> np.ndarray:
    """How unlikely each measurement of a launch is by all evidence but that launch (leave-one-out).

    A standard score each, by the smallest interval of predictions that holds it. By the density's
    quadratic at its mode, within bounds: without a launch the precision is H - d d' and the
    gradient g - d gap, d its columns of `design`.

    Args:
        density: As `widened` gives it.
        widening: By what the evidence's standard deviations are multiplied in it.

    Returns:
        Shape (M,); positive where it flew further than predicted, NaN for a launch that fails.
    """
    launches, box = density.launches, (coordinates.low, coordinates.high)
    assert launches is not None
    scores, ridge = np.full(len(launches.off), np.nan), np.diag(np.diag(density.hessian))
    for i in np.unique(launches.launch[~launches.failed]):
        mine = np.flatnonzero(launches.launch == i)
        gap, design = launches.gap[mine], launches.design[:, mine]
        # Of a coordinate that this launch alone tells nothing else would be left.
        rest = density.hessian - design @ design.T / widening**2 + LEAST_LEFT * ridge
        step = np.linalg.solve(rest, density.gradient - design @ gap / widening**2)
        rng = np.random.default_rng(i)
        phi = truncated_gaussian(
            density.phi + step, rest, *box, LEFT_SAMPLES, rng, coordinates.spikes
        )
        off = (phi - density.phi) @ launches.slopes[:, mine] - launches.off[mine]
        scores[mine] = [
            _score(*of) for of in zip(off.T, widening * launches.spread[mine], strict=True)
        ]
    return scores


def _score(centres: np.ndarray, spread: float) -> float:
    """Standard score of 0 among predictions: Gaussians of a spread around centres (N,).

    As likely as what is less dense (Hyndman, 1996, 10.1080/00031305.1996.10474359): a central
    interval would leave out the densest where they end at a bound.
    """
    spread = np.hypot(spread, LEFT_SMOOTHING * centres.std())
    low, high = min(centres.min(), 0.0) - 6 * spread, max(centres.max(), 0.0) + 6 * spread
    places = np.append(np.linspace(low, high, LEFT_PLACES), 0.0)
    dense = np.exp(-0.5 * ((places[:, None] - centres) / spread) ** 2).mean(axis=1)
    dense, here = dense[:-1], dense[-1]
    less = dense[dense <= here].sum() / dense.sum()
    return float(np.sign(-np.median(centres)) * -ndtri(np.clip(less / 2, 1e-12, 0.5)))


@dataclass(frozen=True)
class QuadraticSurface:
    """Residuals as quadratic polynomials of the coordinates, in units of a scale around a centre.

    Attributes:
        centre, scale: Shape (D,).
        gram: Of the polynomials' F coefficients b of each residual, the sum of b b', (F, F).
    """

    centre: np.ndarray
    scale: np.ndarray
    gram: np.ndarray

    @classmethod
    def fitted(
        cls,
        centre: np.ndarray,
        scale: np.ndarray,
        phi: np.ndarray,
        residuals: np.ndarray,
        weight: np.ndarray,
    ) -> QuadraticSurface:
        """Fit residuals (N, R) at coordinates (N, D), each of a weight, by least squares."""
        terms = _terms((phi - centre) / scale)
        ridge = np.where(np.arange(terms.shape[1]) > len(centre), SURFACE_RIDGE, 1e-9)
        weighted = terms.T * weight
        coefficients = np.linalg.solve(weighted @ terms + np.diag(ridge), weighted @ residuals)
        return cls(centre, scale, coefficients @ coefficients.T)

    def misfit(self, phi: np.ndarray) -> np.ndarray:
        """Sums of the residuals' squares at coordinates (N, D), shape (N,)."""
        terms = _terms((phi - self.centre) / self.scale)
        return np.einsum("nf,nf->n", terms @ self.gram, terms)


def _terms(x: np.ndarray) -> np.ndarray:
    """1, x and products of two, of x (N, D), shape (N, F)."""
    first, second = np.triu_indices(x.shape[1])
    return np.hstack([np.ones((len(x), 1)), x, x[:, first] * x[:, second]])


def samples_of(remaining: Remaining, widening: float, seed: int) -> tuple[np.ndarray, float, int]:
    """SAMPLES of the density around a fit, and how many of even weight they are worth.

    Args:
        widening: By what the evidence's standard deviations are multiplied.

    Returns:
        Shape (SAMPLES, D), some of them alike; the effective number: 0, with those of the widened
        Gaussian, where all simulations fail; and how many batches were simulated.
    """
    coordinates, random = remaining.coordinates, RandomState(seed)
    rectified = coordinates.rectified
    density = widened(remaining.fitted, coordinates, widening)
    scale = np.sqrt(np.diag(np.linalg.inv(density.hessian)))
    batch = samples_around(density, coordinates, np.random.default_rng(seed))

    def log(phi: np.ndarray, misfit: np.ndarray) -> np.ndarray:
        return log_density(coordinates, phi, misfit, widening)

    surface, phi, residuals, best, count = None, batch[:0], None, (batch, 0.0), 0
    while count < BATCHES:
        seen, count = remaining(batch), count + 1
        if surface is not None:
            exact = log(batch, np.sum(seen**2, axis=1))
            weighed = _resampled(
                batch, exact - log(batch, surface.misfit(rectified(batch))), random
            )
            best = max(best, weighed, key=lambda it: it[1])
            if best[1] > ENOUGH_EFFECTIVE:
                break
        phi = np.concatenate([phi, batch])
        residuals = seen if residuals is None else np.concatenate([residuals, seen])
        good = np.isfinite(residuals).all(axis=1)
        if not good.any():
            break
        logs = log(phi[good], np.sum(residuals[good] ** 2, axis=1))
        weight = np.exp(SURFACE_TEMPER * (logs - logs.max()))
        surface = QuadraticSurface.fitted(
            density.phi, scale, rectified(phi[good]), residuals[good], weight
        )
        batch = _evolved(lambda at, by=surface: log(at, by.misfit(rectified(at))), batch, random)
    samples, effective = best
    return rectified(samples), effective, count


def _resampled(
    batch: np.ndarray, logs: np.ndarray, random: RandomState
) -> tuple[np.ndarray, float]:
    """Draw N of samples (N, D) by the logarithms of their weights (N,); and the effective number.

    Systematic resampling: one random number, and even steps from there.
    """
    if np.isneginf(logs).all():
        return batch, 0.0
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    places = (random.random_sample() + np.arange(len(batch))) / len(batch)
    chosen = np.searchsorted(np.cumsum(weights), places).clip(max=len(batch) - 1)
    return batch[chosen], float(1 / np.sum(weights**2))


def _evolved(
    log: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    random: RandomState,
) -> np.ndarray:
    """Ends (N, D) of chains from `start` (N, D) after CHAIN_STEPS, by differential evolution."""
    import emcee

    # Its snooker move, as of 3.1.6, samples a normal density 7 to 23 % too narrow.
    count, axes = start.shape
    move = emcee.moves.DEMove()
    chains = emcee.EnsembleSampler(count, axes, log, vectorize=True, moves=move)
    chains.random_state = random.get_state()
    chains.run_mcmc(start, CHAIN_STEPS, skip_initial_state_check=True)
    random.set_state(chains.random_state)
    return np.asarray(chains.get_last_sample().coords)
