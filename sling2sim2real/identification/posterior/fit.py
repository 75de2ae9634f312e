"""The mode of the density by Levenberg-Marquardt within bounds, and the Gaussian around it.

    -2 log p(phi, n | evidence) = |r(phi, n)|^2

r are the residuals of all recordings, whitened, those of the launches, and the priors of the
coordinates phi and of each recording's own nuisances n. Of r the fit has the slopes J; its step
least |r + J d|^2, damped, within bounds.

The density has no one form. Points are sorted into bins where a pass begins, and what the loss
factor does to the force does not count: r is as if that factor were what it is where a step
begins. So misfits compare within a step, both of one form; and a fit has settled only where a pass
ends near to where it began.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import lsq_linear

from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.posterior.coordinates import LOSS, Coordinates
from sling2sim2real.identification.posterior.expansion import Expansion, Linearised
from sling2sim2real.identification.posterior.launches import LaunchExpansion, LaunchLikelihood
from sling2sim2real.identification.posterior.likelihood import SIMULATED, Failed, Likelihood

PASSES = 4  # at most
ITERATIONS = 30  # of a pass, at most
LONGEST_STEP = 20.0  # of a step, in those of the finite differences
SETTLED_SIZE = 0.1  # of a last step, in standard deviations: no interval is 1 % wider by as much
# Of -2 log p: so little that a step which changes it by less tells nothing apart.
NEGLIGIBLE_MISFIT = 0.2
NEGLIGIBLE_SIZE = 1.0  # standard deviations that such a step may go
LEAST_SLOPE = 1e-6  # of a column's length, where nothing tells a coordinate
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e4  # Levenberg's, relative to the diagonal
DAMPING_RAISED, DAMPING_LOWERED = 10.0, 0.05  # by these factors
DAMPING_AFTER_FAILURE = 1.0  # at least, after a step that went wrong: it halves the next one


class NoFit(UserError):
    """Simulations fail wherever the fit goes."""


@dataclass(frozen=True)
class Fit:
    """The density around a point; that of a fit is its mode.

    Attributes:
        phi: Coordinates, shape (D,).
        nuisances: Of each recording, shape (N, 3).
        expansions: Of each recording there.
        launches: Their expansion there; None without.
        evidence: Of all of them and of the priors: r, J by phi and by n.
        hessian, gradient: Of -log p in phi alone, and of log p: 0 but at bounds; (D, D), (D,).
        steps: How many expansions it took.
        settled: Whether the fit ended near to where it began to take one form of the density.
    """

    phi: np.ndarray
    nuisances: np.ndarray
    expansions: list[Expansion]
    launches: LaunchExpansion | None
    evidence: Linearised
    hessian: np.ndarray
    gradient: np.ndarray
    steps: int
    settled: bool = False

    @property
    def misfit(self) -> float:
        """-2 log p, priors included."""
        return self.evidence.misfit

    def misfit_of(self, other: Fit) -> float:
        """Another point's in the form that the density has here."""
        moved = (other.phi[LOSS] - self.phi[LOSS]) * self.evidence.uncounted
        residual = other.evidence.residual - moved
        return float(residual @ residual)

    def size(self, step: np.ndarray) -> float:
        """Length of a step of coordinates (D,), in standard deviations along it (Mahalanobis)."""
        return float(np.sqrt(step @ self.hessian @ step))


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

    A step into the failure of a recording's simulation, or of a launch that counts, is none. A
    launch that fails where a pass begins does not count in it.

    Args:
        launches: That are evidence too.
        workers: Threads; they change no result.
        progress: Called for each expansion that is nearer.
    """
    steps = 0
    with ThreadPoolExecutor(workers) as pool:

        def expanded(phi: np.ndarray, nuisances: np.ndarray, begun: Fit | None) -> Fit:
            nonlocal steps
            steps += 1
            around = coordinates.parameters, phi, coordinates.differences(phi)
            forms = [x.form for x in begun.expansions] if begun else [None] * len(recordings)
            expansions = [
                likelihood.expand(*around, own, pool, form)
                for likelihood, own, form in zip(recordings, nuisances, forms, strict=True)
            ]
            launched = launches.expand(*around) if launches else None
            left_out = begun.launches.failed if begun and begun.launches else None
            return _stacked(coordinates, phi, nuisances, expansions, launched, left_out, steps)

        phi, nuisances = np.array(start, float), np.zeros((len(recordings), len(SIMULATED)))
        best, settled = None, False
        for _ in range(PASSES):
            try:
                begun = expanded(phi, nuisances, None)
            except Failed as why:
                raise NoFit(
                    f"{recordings[0].episode.band}: the simulation at the start of the fit"
                    f" fails: {why}"
                ) from None
            progress(begun)
            best, still = _descended(begun, coordinates, expanded, progress)
            settled = (
                still and best.size(best.phi - begun.phi) < SETTLED_SIZE and _same(best, begun)
            )
            phi, nuisances = best.phi, best.nuisances
            if settled:
                break
    assert best is not None
    return replace(best, settled=settled, steps=steps)


def _descended(
    begun: Fit,
    coordinates: Coordinates,
    expanded: Callable[[np.ndarray, np.ndarray, Fit | None], Fit],
    progress: Callable[[Fit], None],
) -> tuple[Fit, bool]:
    """Where a pass ends, and whether any further step would be small, hardly damped."""
    best, damp, count = begun, FIRST_DAMPING, len(begun.phi)
    for _ in range(ITERATIONS):
        # Damping makes any step short, also where the fit is stuck.
        if best.size(_step(best, coordinates, min(damp, FIRST_DAMPING))[:count]) < SETTLED_SIZE:
            return best, True
        step = _step(best, coordinates, damp)
        nuisances = best.nuisances + step[count:].reshape(best.nuisances.shape)
        try:
            trial = expanded(best.phi + step[:count], nuisances, begun)
        except Failed:
            trial = None
        misfit = best.misfit_of(trial) if trial else np.inf
        if trial and misfit < best.misfit:
            best, damp = trial, damp * DAMPING_LOWERED
            progress(best)
            continue
        if misfit < best.misfit + NEGLIGIBLE_MISFIT and best.size(step[:count]) < NEGLIGIBLE_SIZE:
            return best, True
        damp = max(damp * DAMPING_RAISED, DAMPING_AFTER_FAILURE)
        if damp > MOST_DAMPING:
            break
    return best, False


def _step(at: Fit, coordinates: Coordinates, damp: float) -> np.ndarray:
    """Least of |r + J d|^2, damped, within the bounds and LONGEST_STEP, shape (D + 3 N,)."""
    residual, slopes = at.evidence.residual, at.evidence.slopes
    slopes = np.hstack([slopes, at.evidence.nuisance_slopes])
    count, unknowns = len(at.phi), slopes.shape[1]
    size = np.maximum(np.linalg.norm(slopes, axis=0), LEAST_SLOPE)
    design = np.vstack([slopes / size, np.sqrt(damp) * np.eye(unknowns)])
    basis, triangle = np.linalg.qr(design)
    aim = -basis[: len(residual)].T @ residual
    low, high = np.full((2, unknowns), [[-np.inf], [np.inf]])
    longest = LONGEST_STEP * coordinates.steps
    low[:count] = np.maximum(coordinates.low - at.phi, -longest)
    high[:count] = np.minimum(coordinates.high - at.phi, longest)
    ends = low * size - 1e-12, high * size + 1e-12
    return np.clip(lsq_linear(triangle, aim, ends, method="bvls").x / size, low, high)


def _same(a: Fit, b: Fit) -> bool:
    """Whether the same launches fail."""
    return not (a.launches and b.launches and np.any(a.launches.failed != b.launches.failed))


def _stacked(
    coordinates: Coordinates,
    phi: np.ndarray,
    nuisances: np.ndarray,
    expansions: list[Expansion],
    launched: LaunchExpansion | None,
    left_out: np.ndarray | None,
    steps: int,
) -> Fit:
    """All evidence at a point. Raises Failed where a launch fails that counts.

    Args:
        left_out: Which launches do not count; None: those that fail here.
    """
    root, count = np.sqrt(coordinates.precision), len(phi)
    gap = root * (phi - coordinates.expected)
    prior = Linearised(gap, np.diag(root), np.zeros((count, 0)), np.zeros(count))
    rows, parts = [prior], []
    if launched:
        left_out = launched.failed if left_out is None else left_out
        if (launched.failed & ~left_out).any():
            raise Failed("a launch that landed fails")
        rows, parts = [prior, launched.of(~left_out)], [launched.landed]
    rows, parts = [*rows, *expansions], [*parts, *expansions]
    evidence = Linearised(
        np.concatenate([part.residual for part in rows]),
        np.vstack([part.slopes for part in rows]),
        np.asarray(block_diag(*(part.nuisance_slopes for part in rows))),
        np.concatenate([part.uncounted for part in rows]),
    )
    hessian = sum((part.hessian for part in parts), np.diag(coordinates.precision))
    gradient = sum((part.gradient for part in parts), -root * gap)
    return Fit(phi, nuisances, expansions, launched, evidence, hessian, gradient, steps)


def held(fitted: Fit, coordinates: Coordinates) -> np.ndarray:
    """Which coordinates (D,) lie at a bound beyond which the density would be larger."""
    low, high = fitted.phi <= coordinates.low, fitted.phi >= coordinates.high
    return np.where(fitted.gradient < 0, low, high)


def widened(fitted: Fit, coordinates: Coordinates, by: float) -> Fit:
    """The density where all evidence, but no prior, is less sure: standard deviations times `by`.

    A gradient counts where it leads out of the bounds. Elsewhere it is what a settled fit left of
    a step that led no further.
    """
    prior = coordinates.precision
    pull = prior * (coordinates.expected - fitted.phi)
    hessian = (fitted.hessian - np.diag(prior)) / by**2 + np.diag(prior)
    gradient = (fitted.gradient * held(fitted, coordinates) - pull) / by**2 + pull
    return replace(fitted, hessian=hessian, gradient=gradient)
