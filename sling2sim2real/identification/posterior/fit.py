"""The mode of the density by Levenberg-Marquardt within bounds, and the Gaussian around it.

    -2 log p(phi | evidence) = sum of the recordings' misfits + that of the launches + priors

Each recording's nuisances are its own and eliminated in it, so that what is left is a few
coordinates, whatever the number of recordings; and leaving one out is a subtraction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.posterior.coordinates import Coordinates
from sling2sim2real.identification.posterior.expansion import Expansion
from sling2sim2real.identification.posterior.launches import LaunchExpansion, LaunchLikelihood
from sling2sim2real.identification.posterior.likelihood import Failed, Likelihood

PASSES = 6  # at most; each sorts the points into bins anew, where the last one ended
ITERATIONS = 30  # of a pass, at most
LONGEST = 20.0  # of a step, in those of the finite differences
STILL = 0.1  # of a last step, in standard deviations: no interval is 1 % wider by as much
FLAT = 0.2  # of -2 log p: so little that a step which changes it by less tells nothing apart
NEAR = 1.0  # standard deviations that such a step may go
LEAST = 1e-12  # of a precision
DAMP, HARDER, EASIER, HARDEST = 1e-3, 10.0, 0.05, 1e4  # Levenberg's, relative to the diagonal
HALF = 1.0  # at least, after a step that went wrong: it halves the next one


class NoFit(UserError):
    """Simulations fail wherever the fit goes."""


@dataclass(frozen=True)
class Fit:
    """The density around its mode.

    Attributes:
        phi: The mode, shape (D,).
        hessian, gradient: Of -log p there, and of log p: 0 but at bounds; (D, D), (D,).
        nuisances: Of each recording, shape (N, 3).
        expansions: Of each recording there.
        launches: Their expansion there; None without.
        misfit: -2 log p there, priors included.
        steps: How many expansions it took.
        settled: Whether the next step would be small, hardly damped.
    """

    phi: np.ndarray
    hessian: np.ndarray
    gradient: np.ndarray
    nuisances: np.ndarray
    expansions: list[Expansion]
    launches: LaunchExpansion | None
    misfit: float
    steps: int
    settled: bool


def fit(
    recordings: Sequence[Likelihood],
    coordinates: Coordinates,
    start: np.ndarray,
    *,
    launches: LaunchLikelihood | None = None,
    workers: int | None = None,
    progress: Callable[[Fit], None] = lambda fit: None,
) -> Fit:
    """Fit coordinates from `start` (D,). Raises NoFit.

    Each pass has a density of one form: bins, and what the loss factor does to the force, are
    those of its first expansion. Misfits of different passes do not compare. It is settled where
    a pass ends near to where it began.

    A step into the failure of a recording's simulation, or of a launch that landed, is none. A
    launch that fails from the start counts as soon as a step makes it land.

    Args:
        launches: That are evidence too.
        workers: Threads; they change no result.
        progress: Called for each expansion that is nearer.
    """
    steps = 0
    with ThreadPoolExecutor(workers) as pool:

        def expanded(phi: np.ndarray, nuisances: np.ndarray, reference: Fit | None) -> Fit:
            nonlocal steps
            steps += 1
            around = coordinates.parameters, phi, _steps(coordinates, phi)
            references = reference.expansions if reference else [None] * len(recordings)
            expansions = [
                likelihood.expand(*around, nuisance, pool, fixed)
                for likelihood, nuisance, fixed in zip(
                    recordings, nuisances, references, strict=True
                )
            ]
            launched = launches.expand(*around) if launches else None
            return _density(coordinates, phi, nuisances, expansions, launched, steps)

        phi, nuisances = np.array(start, float), np.zeros((len(recordings), 3))
        best, near = None, False
        for _ in range(PASSES):
            try:
                begun = expanded(phi, nuisances, None)
            except Failed as why:
                raise NoFit(
                    f"{recordings[0].episode.band}: the simulation at the start of the fit"
                    f" fails: {why}"
                ) from None
            progress(begun)
            best = _descended(begun, coordinates, expanded, progress)
            near = _size(best, best.phi - begun.phi) < STILL
            phi, nuisances = best.phi, best.nuisances
            if near or not best.settled:
                break
    assert best is not None
    return replace(best, settled=best.settled and near, steps=steps)


def _descended(
    best: Fit,
    coordinates: Coordinates,
    expanded: Callable[[np.ndarray, np.ndarray, Fit | None], Fit],
    progress: Callable[[Fit], None],
) -> Fit:
    """The mode of one pass by Levenberg-Marquardt from its first expansion."""
    damp = DAMP
    for _ in range(ITERATIONS):
        if _size(best, _step(best, coordinates, min(damp, DAMP))) < STILL:
            return replace(best, settled=True)  # damping makes any step short
        step = _step(best, coordinates, damp)
        nuisances = np.array(
            [
                nuisance + expansion.nuisances[0] / (1 + damp) + expansion.nuisances[1] @ step
                for nuisance, expansion in zip(best.nuisances, best.expansions, strict=True)
            ]
        )
        try:
            trial = expanded(best.phi + step, nuisances, best)
        except Failed:
            trial = None
        if trial and _fails_more(trial, best):
            trial = None
        if trial and _nearer(trial, best):
            best, damp = trial, damp * EASIER
            progress(best)
            continue
        if trial and trial.misfit < best.misfit + FLAT and _size(best, step) < NEAR:
            return replace(best, settled=True)
        damp = max(damp * HARDER, HALF)
        if damp > HARDEST:
            break
    return best


def widened(fitted: Fit, coordinates: Coordinates, by: float) -> Fit:
    """The density where all evidence, but no prior, is less sure: standard deviations times `by`.

    A gradient counts where it leads out of the bounds. Elsewhere it is what a settled fit left of
    a step that led no further.
    """
    low, high = coordinates.low, coordinates.high
    outward = np.where(fitted.gradient < 0, fitted.phi <= low, fitted.phi >= high)
    prior = coordinates.precision
    pull = prior * (coordinates.expected - fitted.phi)
    hessian = (fitted.hessian - np.diag(prior)) / by**2 + np.diag(prior)
    gradient = (fitted.gradient * outward - pull) / by**2 + pull
    return replace(fitted, hessian=hessian, gradient=gradient)


def _fails_more(trial: Fit, best: Fit) -> bool:
    """Whether a launch fails that did not."""
    now, before = trial.launches, best.launches
    return bool(now and before and (now.failed & ~before.failed).any())


def _nearer(trial: Fit, best: Fit) -> bool:
    """Whether the misfit is less, or a launch lands now: what failed had no misfit to compare."""
    return trial.misfit < best.misfit or _fails_more(best, trial)


def _size(fit: Fit, step: np.ndarray) -> float:
    """Length of a step (D,), in standard deviations along it: Mahalanobis's distance."""
    return float(np.sqrt(step @ fit.hessian @ step))


def _steps(coordinates: Coordinates, phi: np.ndarray) -> np.ndarray:
    """Steps of finite differences, away from the upper bounds, shape (D,)."""
    steps = coordinates.steps
    return np.where(phi + steps > coordinates.high, -steps, steps)


def _density(
    coordinates: Coordinates,
    phi: np.ndarray,
    nuisances: np.ndarray,
    expansions: list[Expansion],
    launches: LaunchExpansion | None,
    steps: int,
) -> Fit:
    prior, gap = coordinates.precision, phi - coordinates.expected
    hessian = sum(expansion.hessian for expansion in expansions) + np.diag(prior)
    gradient = sum(expansion.gradient for expansion in expansions) - prior * gap
    misfit = sum(expansion.misfit for expansion in expansions) + float(prior @ gap**2)
    if launches:
        hessian, gradient = hessian + launches.hessian, gradient + launches.gradient
        misfit += launches.misfit
    return Fit(
        phi=phi,
        hessian=hessian,
        gradient=gradient,
        nuisances=nuisances,
        expansions=expansions,
        launches=launches,
        misfit=misfit,
        steps=steps,
        settled=False,
    )


def _step(fit: Fit, coordinates: Coordinates, damp: float) -> np.ndarray:
    """Least of the damped quadratic within the bounds and LONGEST, shape (D,)."""
    longest = LONGEST * coordinates.steps
    low = np.maximum(coordinates.low - fit.phi, -longest)
    high = np.minimum(coordinates.high - fit.phi, longest)
    scale = np.sqrt(np.maximum(np.diag(fit.hessian), LEAST))  # of what nothing tells, too
    hessian = fit.hessian / np.outer(scale, scale) + damp * np.eye(len(scale))
    root = np.linalg.cholesky(hessian).T
    aim = np.linalg.solve(root.T, fit.gradient / scale)
    ends = low * scale - 1e-12, high * scale + 1e-12
    return np.clip(lsq_linear(root, aim, ends, method="bvls").x / scale, low, high)
