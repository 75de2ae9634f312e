"""A band's parameters from its recordings and launches, as the density stage writes them.

One density: its mode is θ*, its samples the intervals. With several recordings it is as wide as
they differ (Birge's ratio, Phys. Rev. 40, 1932): their disagreement beyond what each leaves
open is the model's discrepancy, and no other is assumed but the returned share's prior.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.base.machine import cores
from sling2sim2real.base.parameters import TABLE
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import deepest_draw, launch_history
from sling2sim2real.episode.signal import cutoff_hz
from sling2sim2real.identification.posterior.coordinates import Coordinates
from sling2sim2real.identification.posterior.fit import Fit, fit, widened
from sling2sim2real.identification.posterior.launches import (
    Evidence,
    LaunchLikelihood,
    without_each,
)
from sling2sim2real.identification.posterior.likelihood import SIMULATED, Failed, Likelihood
from sling2sim2real.identification.posterior.residuals import BINS, LEAST_POINTS
from sling2sim2real.identification.posterior.sampling import SAMPLES, Remaining, samples_of
from sling2sim2real.identification.results.theta import content_of
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import parameter_names
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory
from sling2sim2real.simulator.parameters import EXTRA, Parameters
from sling2sim2real.simulator.rubber import RUBBER

LEVEL = 0.9
SI_UNITS = {row.name: row.si for row in TABLE}
WORTH_WIDENING = 1.2  # times the usual spread: less changes no interval by much
IDENTIFIABLE_SHARE = 2 / 3  # of the prior's interval: one as wide tells nothing


@dataclass(frozen=True)
class Identified:
    """What is known of a band.

    Attributes:
        coordinates, fit: The density, and its mode.
        birge: By what the recordings' disagreement widens the evidence's standard deviations; 1
            for one. Priors stay as they are.
        samples: Of the coordinates, within bounds, shape (SAMPLES, D).
        effective, batches: How many samples of even weight these are worth, and how many batches
            of SAMPLES rollouts they took of each recording.
        recordings, launches: The evidence.
    """

    coordinates: Coordinates
    fit: Fit
    birge: float
    samples: np.ndarray
    effective: float
    batches: int
    recordings: list[Likelihood]
    launches: LaunchLikelihood | None

    @property
    def density(self) -> Fit:
        """The Gaussian around the mode, as wide as the recordings differ."""
        return widened(self.fit, self.coordinates, self.birge)

    @property
    def mode(self) -> Parameters:
        """θ*, one sample."""
        return self.coordinates.parameters(self.fit.phi[None])

    @property
    def parameters(self) -> Parameters:
        """Parameters of the SAMPLES samples."""
        return self.coordinates.parameters(self.samples)

    @property
    def rollouts(self) -> int:
        """Simulated interactions of the fit, and of the samples."""
        each = len(self.coordinates.names) + len(SIMULATED)  # with the mode, without the clock
        return len(self.recordings) * (self.fit.steps * each + self.batches * SAMPLES)


def fit_posterior(
    params: Settings,
    method: str,
    sling: ClampedBand,
    episodes: Sequence[Episode],
    start: Parameters,
    *,
    evidence: Evidence | None = None,
    workers: int | None = None,
    progress: Callable[[Fit], None] = lambda fit: None,
) -> Identified:
    """Fit the density of a band.

    Args:
        method: Of params.yaml, one that searches by least squares.
        episodes: Of the band's recordings, at least one.
        start: One sample: the nearest that an exploration found.
        evidence: Launches, drawn as the first recording was, one after the other, after all
            recordings.

    Raises:
        NoFit: Simulations fail at the start.
        UserError: A recording shows no band.
    """
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    friction = params.methods[method].fixed["dynamic_friction"]
    recordings = [Likelihood(episode, sling, cutoff, friction) for episode in episodes]
    coordinates = Coordinates.of_method(params, method, sling)
    launches = None
    if evidence and evidence.launches:
        setup = replace(evidence.setup, history=recorded_history(sling, episodes))
        launches = LaunchLikelihood(evidence.launches, sling, setup, workers or cores())
    options = {"launches": launches, "workers": workers, "progress": progress}
    begin = coordinates.of(start)
    nearest = coordinates.parameters(begin[None])
    try:
        recordings = [recording.aligned(nearest) for recording in recordings]
    except Failed:
        pass  # the fit says why
    fitted = fit(recordings, coordinates, begin, **options)
    follows = [
        recording.with_wider_tolerances(it)
        for recording, it in zip(recordings, fitted.expansions, strict=True)
    ]
    if any(
        getattr(wide.tolerances, what) > WORTH_WIDENING * getattr(recording.tolerances, what)
        for recording, wide in zip(recordings, follows, strict=True)
        for what in ("force", "recoil")
    ):
        recordings, first = follows, fitted
        fitted = fit(recordings, coordinates, first.phi, **options)
        fitted = replace(fitted, steps=first.steps + fitted.steps)
    for expansion in fitted.expansions:
        if not len(expansion.form.residuals.picture):
            print(
                f"note: {expansion.form.residuals.episode.band}: its pictures show fewer than"
                f" {LEAST_POINTS} points in each of {BINS} parts of the band, so its force alone is"
                " fitted",
                file=sys.stderr,
            )
    birge = birge_ratio(fitted)
    evidence_left = Remaining(fitted, coordinates, recordings, launches, workers or cores())
    samples, effective, batches = samples_of(evidence_left, birge, params.optimizer.seed)
    return Identified(coordinates, fitted, birge, samples, effective, batches, recordings, launches)


def recorded_history(sling: ClampedBand, episodes: Sequence[Episode]) -> LaunchHistory | None:
    """What a band remembers that is launched as it was first recorded, after all recordings.

    None for a law without memory.
    """
    if sling.law != RUBBER:
        return None
    pull_history = launch_history(episodes[0])
    return LaunchHistory(pull_history["pull_time"], pull_history["pause"], deepest_draw(episodes))


def birge_ratio(fitted: Fit) -> float:
    """Birge's ratio of N recordings, at least 1: how far each alone would go from the mode.

    Of each, the drop of its misfit to its own least is chi squared of D' D (N - 1)/N coordinates
    that it tells, D' those which it knows better than the rest together.
    """
    if len(fitted.expansions) < 2:
        return 1.0
    total = freedom = 0.0
    for expansion in fitted.expansions:
        # The sum is regular where the recording alone shows nothing.
        inverse = np.linalg.inv(expansion.hessian + fitted.hessian)
        share = np.linalg.solve(fitted.hessian, expansion.hessian)
        total += expansion.gradient @ inverse @ expansion.gradient
        freedom += np.trace(inverse @ expansion.hessian @ (np.eye(len(share)) - share))
    return float(np.sqrt(max(total / max(freedom, 1e-9), 1.0)))


def theta_entries(identified: Identified) -> dict:
    """What a θ file holds of the mode: of the band after its recordings and launches."""
    episodes = [recording.episode for recording in identified.recordings]
    history = recorded_history(identified.recordings[0].sling, episodes)
    if history and identified.launches:
        history = replace(history, deepest=identified.launches.after)
    return content_of(identified.mode, history)


def confidence(identified: Identified) -> dict:
    """What a θ file says under `confidence`, ready for JSON.

    A parameter is identifiable if its interval is less than IDENTIFIABLE_SHARE of its prior's, as
    the coordinate that shows it has them.
    """
    samples, mode, parameters = identified.parameters, identified.mode.sample(), {}
    columns = {name: samples.column(name) for name in samples.names}
    product = "damping_product"
    columns[product] = columns["elasticity_damping"] * columns["damping_scale"]
    mode[product] = mode["elasticity_damping"] * mode["damping_scale"]
    priors = _priors(identified)
    for name in parameter_names(samples.law):
        low, high = interval(columns[name], mode[name])
        entry = {"low": low, "high": high, "identifiable": name in priors}
        if name in priors:
            entry |= priors[name]
        else:
            entry["fixed"] = True
        parameters[name] = entry
    derived = {
        name: _told(columns[name], mode[name], SI_UNITS[name]) | priors[name]
        for name in (*EXTRA, product)
    }
    derived |= _clocks(identified)
    return {
        "level": LEVEL,
        "parameters": parameters,
        "derived": derived,
        "correlation": {
            "names": list(identified.coordinates.names),
            "matrix": correlation(identified.samples).tolist(),
        },
        "recordings": [_left(identified, number) for number in range(len(identified.recordings))],
        "disagreement": identified.birge,
        "launches": _launched(identified),
        "steps": identified.fit.steps,
        "settled": identified.fit.settled,
        "effective_samples": identified.effective,
    }


def _priors(identified: Identified) -> dict[str, dict]:
    """Priors of what is not fixed: the interval, all else at the mode; and if it is identified."""
    coordinates, result = identified.coordinates, {}
    ends = coordinates.prior(LEVEL)
    widths = np.ptp(
        np.quantile(identified.samples, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0), axis=0
    )
    for name in (*parameter_names(coordinates.law), *EXTRA, "damping_product"):
        axis = coordinates.shows(name)
        if axis is None:
            continue
        phi = np.repeat(identified.fit.phi[None], 2, axis=0)
        phi[:, axis] = ends[:, axis]
        at = coordinates.parameters(phi)
        if name == "damping_product":
            values = at.column("elasticity_damping") * at.column("damping_scale")
        else:
            values = at.column(name)
        summary = bool(widths[axis] < IDENTIFIABLE_SHARE * np.ptp(ends[:, axis]))
        result[name] = {"prior": values.tolist(), "identifiable": summary}
    return result


def correlation(samples: np.ndarray) -> np.ndarray:
    """Correlations of D columns of samples (M, D), shape (D, D); one that is constant has none."""
    varies = np.ptp(samples, axis=0) > 0
    matrix = np.eye(len(varies))
    matrix[np.ix_(varies, varies)] = np.corrcoef(samples[:, varies].T)
    return matrix


def interval(samples: np.ndarray, mode: float) -> tuple[float, float]:
    """The central LEVEL of samples (M,); from the end on beside which the mode lies, if it does."""
    low, high = np.quantile(samples, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    if mode < low:
        low, high = min(mode, samples.min()), np.quantile(samples, LEVEL)
    elif mode > high:
        low, high = np.quantile(samples, 1 - LEVEL), max(mode, samples.max())
    return float(low), float(high)


def _told(samples: np.ndarray, mode: float, unit: str) -> dict:
    low, high = interval(samples, mode)
    return {"value": mode, "low": low, "high": high, "unit": unit}


def _clocks(identified: Identified) -> dict:
    """Release and camera's delay of the first recording, with what its expansion leaves open."""
    expansion, nuisances = identified.fit.expansions[0], identified.fit.nuisances[0]
    change = expansion.nuisance_change
    covariance = np.linalg.inv(identified.density.hessian)
    spread = np.sqrt(
        expansion.nuisance_spread**2 + np.einsum("id,de,ie->i", change, covariance, change)
    )
    release, camera = (SIMULATED.index(name) for name in ("release", "camera"))
    time = identified.recordings[0].episode.release_time + nuisances[release]
    wide = 1.645 * spread
    return {
        name: {"value": value, "low": value - wide[i], "high": value + wide[i], "unit": "s"}
        for name, value, i in (
            ("release_time", time, release),
            ("camera_delay", -nuisances[camera] - identified.recordings[0].moved, camera),
        )
    }


def _left(identified: Identified, number: int) -> dict:
    """What a recording shows that the simulation does not, and what the others alone say of it."""
    expansion, recording = identified.fit.expansions[number], identified.recordings[number]
    entry: dict = {"force_rms": expansion.rms("force"), "held_rms": expansion.rms("held")}
    entry |= {"recoil_rms": expansion.rms("recoil"), "pictures": expansion.pictures}
    entry["source"] = recording.episode.metadata.get("input", {})
    if len(identified.recordings) > 1:
        entry["without_it"] = leave_one_out(identified, number)
    return entry


def leave_one_out(identified: Identified, number: int) -> dict:
    """How the mode of all other evidence predicts the one left out, by their quadratics."""
    expansion = identified.fit.expansions[number]
    hessian, gradient = (
        identified.fit.hessian - expansion.hessian,
        identified.fit.gradient - expansion.gradient,
    )
    phi = np.clip(
        identified.fit.phi + np.linalg.solve(hessian, gradient),
        identified.coordinates.low,
        identified.coordinates.high,
    )
    moved = phi - identified.fit.phi
    worse = moved @ expansion.hessian @ moved - 2 * expansion.gradient @ moved
    spread = np.sqrt(np.diag(np.linalg.inv(hessian)))
    return {
        "misfit": float(worse),
        "moved": dict(zip(identified.coordinates.names, (moved / spread).tolist(), strict=True)),
    }


def _launched(identified: Identified) -> list[dict]:
    launches, expansion = identified.launches, identified.fit.launches
    if launches is None or expansion is None:
        return []
    density = identified.density
    unlikely = without_each(expansion, density.hessian, density.gradient, identified.birge)
    parts = launches.draws, launches.landings, expansion.left, unlikely
    return [
        {
            "draw": draw.tolist(),
            "landing": float(landing),
            "left": None if gap != gap else float(gap),
            "z_without_it": None if z != z else float(z),
        }
        for draw, landing, gap, z in zip(*parts, strict=True)
    ]
