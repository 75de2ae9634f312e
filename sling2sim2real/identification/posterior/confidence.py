"""What is written of a fitted density: the loss of its mode, θ, and how sure it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import lsq_linear

from sling2sim2real.base.parameters import TABLE
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.posterior.coordinates import DAMPING, PRODUCT
from sling2sim2real.identification.posterior.identify import Identified, recorded_history
from sling2sim2real.identification.posterior.launches import MEASURED
from sling2sim2real.identification.posterior.likelihood import SIMULATED
from sling2sim2real.identification.posterior.sampling import without_each
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.results.theta import content_of
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import POSTERIOR, parameter_names
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import EXTRA, Parameters

LEVEL = 0.9  # of all intervals
ENDS = (1 - LEVEL) / 2, (1 + LEVEL) / 2  # quantiles
HALF_WIDTH = 1.645  # of an interval, in a Gaussian's standard deviations
IDENTIFIABLE_SHARE = 2 / 3  # of the prior's interval: one as wide tells nothing
SI_UNITS = {row.name: row.si for row in TABLE}


def evaluated_mode(
    params: Settings, method: str, sling: ClampedBand, episode: Episode, density: Identified
) -> Evaluations:
    """The mode's loss, one row of the phase `posterior`."""
    mode = density.mode.sample()
    box = SearchBox.of_method(params, method)
    box = replace(box, fixed={name: mode[name] for name in EXTRA})
    evaluate = Evaluator.of(params, method, episode, sling, box)
    evaluations = Evaluations(method, box.names)
    evaluation = evaluate(box.unit_of(density.mode))
    evaluations.add(evaluation, phase=POSTERIOR, generation=density.fit.steps)
    return evaluations


def theta_entries(density: Identified) -> dict:
    """What a θ file holds of the mode: of the band after its recordings and launches."""
    episodes = [recording.episode for recording in density.recordings]
    history = recorded_history(density.recordings[0].sling, episodes)
    if history and density.launches:
        history = replace(history, deepest=density.launches.after)
    return content_of(density.mode, history)


def confidence(density: Identified) -> dict:
    """What a θ file says under `confidence`, ready for JSON.

    A parameter is identifiable if its interval is less than IDENTIFIABLE_SHARE of its prior's, as
    the coordinate that shows it has them.
    """
    names = parameter_names(density.coordinates.law)
    derived = {
        name: {"value": _column(density.mode, name)[0], "unit": SI_UNITS[name]}
        | _interval_entry(density, name)
        for name in (*EXTRA, PRODUCT)
    }
    return {
        "level": LEVEL,
        "parameters": {name: _interval_entry(density, name) for name in names},
        "derived": derived | _clocks(density),
        "correlation": {
            "names": list(density.coordinates.names),
            "matrix": correlation(density.samples).tolist(),
        },
        "recordings": [_recording(density, number) for number in range(len(density.recordings))],
        "disagreement": density.birge,
        "launches": _launches(density),
        "steps": density.fit.steps,
        "settled": density.settled,
        "edges": density.edges,
        "effective_samples": density.effective,
    }


def _column(parameters: Parameters, name: str) -> np.ndarray:
    """Values of a parameter, or of the product of damping, shape (N,)."""
    if name == PRODUCT:
        return parameters.column(DAMPING) * parameters.column("damping_scale")
    return parameters.column(name)


def _interval_entry(density: Identified, name: str) -> dict:
    """Intervals of a parameter: by the samples, and by its prior with all else at the mode."""
    low, high = interval(_column(density.parameters, name), _column(density.mode, name)[0])
    entry = {"low": low, "high": high}
    axis = density.coordinates.shows(name)
    if axis is None:
        return entry | {"identifiable": False, "fixed": True}
    phi = np.repeat(density.fit.phi[None], 2, axis=0)
    phi[:, axis] = density.coordinates.prior(LEVEL)[:, axis]
    width = np.ptp(np.quantile(density.samples[:, axis], ENDS))
    identifiable = bool(width < IDENTIFIABLE_SHARE * np.ptp(phi[:, axis]))
    prior = _column(density.coordinates.parameters(phi), name)
    return entry | {"prior": prior.tolist(), "identifiable": identifiable}


def correlation(samples: np.ndarray) -> np.ndarray:
    """Correlations of D columns of samples (M, D), shape (D, D); one that is constant has none."""
    varies = np.ptp(samples, axis=0) > 0
    matrix = np.eye(len(varies))
    matrix[np.ix_(varies, varies)] = np.corrcoef(samples[:, varies].T)
    return matrix


def interval(samples: np.ndarray, mode: float) -> tuple[float, float]:
    """The central LEVEL of samples (M,); from the end on beside which the mode lies, if it does."""
    low, high = np.quantile(samples, ENDS)
    if mode < low:
        low, high = min(mode, samples.min()), np.quantile(samples, LEVEL)
    elif mode > high:
        low, high = np.quantile(samples, 1 - LEVEL), max(mode, samples.max())
    return float(low), float(high)


def _clocks(density: Identified) -> dict:
    """Release and camera's delay of the first recording, with what its expansion leaves open."""
    expansion, nuisances = density.fit.expansions[0], density.fit.nuisances[0]
    change = expansion.nuisance_change
    covariance = np.linalg.inv(density.density.hessian)
    spread = np.sqrt(
        expansion.nuisance_spread**2 + np.einsum("id,de,ie->i", change, covariance, change)
    )
    release, camera = (SIMULATED.index(name) for name in ("release", "camera"))
    time = density.recordings[0].episode.release_time + nuisances[release]
    wide = HALF_WIDTH * spread
    return {
        name: {"value": value, "low": value - wide[i], "high": value + wide[i], "unit": "s"}
        for name, value, i in (
            ("release_time", time, release),
            ("camera_delay", -nuisances[camera] - density.recordings[0].camera_shift, camera),
        )
    }


def _recording(density: Identified, number: int) -> dict:
    """What a recording shows that the simulation does not, and what the others alone say of it."""
    expansion, episode = density.fit.expansions[number], density.recordings[number].episode
    entry = {f"{part}_rms": expansion.rms(part) for part in ("force", "held", "recoil")}
    entry |= {"pictures": expansion.pictures, "source": episode.metadata.get("input", {})}
    if len(density.recordings) > 1:
        entry["misfit_without"] = misfit_without(density, number)
    return entry


def misfit_without(density: Identified, number: int) -> float:
    """How much worse the mode of all other evidence fits a recording, by their quadratics."""
    expansion, phi = density.fit.expansions[number], density.fit.phi
    hessian = density.fit.hessian - expansion.hessian
    gradient = density.fit.gradient - expansion.gradient
    ends = density.coordinates.low - phi - 1e-12, density.coordinates.high - phi + 1e-12
    ridge = 1e-9 * np.diag(density.fit.hessian)  # where the others tell nothing
    root = np.linalg.cholesky(hessian + np.diag(ridge))
    moved = lsq_linear(root.T, np.linalg.solve(root, gradient), ends, method="bvls").x
    return float(moved @ expansion.hessian @ moved - 2 * expansion.gradient @ moved)


def _launches(density: Identified) -> list[dict]:
    """What the density leaves of each launch's measurements, and scores by all other evidence."""
    launches, expansion = density.launches, density.fit.launches
    if launches is None or expansion is None:
        return []
    scores = without_each(density.density, density.coordinates, density.birge)
    entries = []
    for number, draw in enumerate(launches.draws):
        measured = launches.measured[number]
        names = [name for name, value in zip(MEASURED, measured, strict=True) if value == value]
        mine = expansion.launch == number
        columns = {
            "measured": measured[~np.isnan(measured)],
            "left": expansion.off[mine],
            "z_without_it": scores[mine],
        }
        entries.append(
            {"draw": draw.tolist()}
            | {what: _named(names, values) for what, values in columns.items()}
        )
    return entries


def _named(names: list[str], values: np.ndarray) -> dict[str, float | None]:
    """Values by names; JSON has no NaN."""
    finite = [None if np.isnan(value) else float(value) for value in values]
    return dict(zip(names, finite, strict=True))
