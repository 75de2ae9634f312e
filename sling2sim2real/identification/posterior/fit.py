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

ITERATIONS = 60  # at most
BINNED = 4  # of them sort the points into bins anew; then the density keeps its form
ANEW, FINER = 2, 0.25  # how often a fit that is stuck sorts them anew, by finer differences
LONGEST = 20.0  # of a step, in those of the finite differences
STILL = 0.2  # of a last step, in standard deviations: no interval is 2 % wider by as much
SHORT = 0.25  # of that: a damped step where the fit is stuck
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

    A step into the failure of a recording's simulation, or of a launch that landed, is none. A
    launch that fails from the start counts as soon as a step makes it land.

    Args:
        launches: That are evidence too.
        workers: Threads; they change no result.
        progress: Called for each expansion that is nearer.
    """
    phi, nuisances = np.array(start, float), np.zeros((len(recordings), 3))
    best: Fit | None = None
    damp, gone, new = DAMP, np.inf, [None] * len(recordings)
    anew, sort = 0, True
    with ThreadPoolExecutor(workers) as pool:
        for steps in range(1, ITERATIONS + 1):
            sort = sort or steps <= BINNED
            bins = [x.residuals for x in best.expansions] if best and not sort else new
            around = coordinates.parameters, phi, FINER**anew * _steps(coordinates, phi)
            try:
                expansions = [
                    likelihood.expand(*around, nuisance, pool, retained)
                    for likelihood, nuisance, retained in zip(
                        recordings, nuisances, bins, strict=True
                    )
                ]
            except Failed as why:
                if best is None:
                    raise NoFit(
                        f"{recordings[0].episode.band}: the simulation at the start of the fit"
                        f" fails: {why}"
                    ) from None
                trial = None
            else:
                launched = launches.expand(*around) if launches else None
                trial = _density(coordinates, phi, nuisances, expansions, launched, steps)
            if best and trial and _fails_more(trial, best):
                trial = None
            if trial and (best is None or _nearer(trial, best) or sort):
                best, damp = trial, damp * EASIER
                progress(best)
            else:
                if trial and best and trial.misfit < best.misfit + FLAT and gone < NEAR:
                    return replace(best, settled=True, steps=steps)
                damp = max(damp * HARDER, HALF)
            assert best is not None  # else NoFit
            sort = False
            step = _step(best, coordinates, damp)
            gone = _size(best, step)
            # Damping makes any step short, also where the fit is stuck.
            settled = _size(best, _step(best, coordinates, min(damp, DAMP))) < STILL
            if settled or gone < SHORT * STILL or damp > HARDEST:
                if settled or anew == ANEW:
                    return replace(best, settled=settled, steps=steps)
                anew, sort, damp, step = anew + 1, True, DAMP, 0 * step
            phi = best.phi + step
            nuisances = np.array(
                [
                    nuisance + expansion.nuisances[0] / (1 + damp) + expansion.nuisances[1] @ step
                    for nuisance, expansion in zip(best.nuisances, best.expansions, strict=True)
                ]
            )
    assert best is not None
    return replace(best, steps=ITERATIONS)


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
