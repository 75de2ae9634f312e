"""How sure θ is, as the theta stage writes it: intervals, correlations, samples, profile curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.confidence.axes import Axes
from pipeline.confidence.discrepancy import discrepancy
from pipeline.confidence.intervals import LEVEL, correlation, identifiable, interval
from pipeline.confidence.posterior import Posterior, fit
from pipeline.confidence.profile import profiles
from pipeline.confidence.residuals import PHASES
from pipeline.episode.episode import Episode
from pipeline.episode.signal import cutoff_hz

SAMPLES = 200  # that are kept
UNITS = {
    "damping_product": "s",
    "hold_force": "N",
    "release_time": "s",
    "camera_delay": "s",
    "air_drag": "1/s",
}
SLIP = 1.01  # times the least friction that holds the measured force


def confidence(
    params, method: str, episode: Episode, sling, content: dict, *, workers: int | None = None
) -> tuple[dict, dict]:
    """What a θ file says under `confidence`, and what data/confidence keeps.

    The box is the method's own. A searched drag of the air is an axis beside θ; what instruments
    add, which a method may have searched too, is taken off the recording, and what is left of it
    is marginalised.

    Args:
        content: Of the θ file: "theta" and "nuisances".

    Raises:
        NoConfidence: Too many simulations around θ* fail.
    """
    episode = corrected(episode, content["nuisances"])
    peak = np.linalg.norm(episode.force, axis=1).max()
    axes = Axes.of_method(params, method, content, SLIP * peak / sling.grip_force)
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    posterior = fit(episode, sling, cutoff, axes, axes.theta, workers=workers)
    curves = profiles(posterior, workers=workers)
    known = summary(posterior, curves)
    known["discrepancy"] = discrepancy(episode, sling, cutoff, axes.theta)
    return known, kept(posterior, curves)


def corrected(episode: Episode, nuisances: dict[str, float]) -> Episode:
    """The episode without what its instruments add, as a θ file's nuisances say it."""

    def vector(name: str) -> np.ndarray:
        return np.array([nuisances.get(f"{name}_{axis}", 0.0) for axis in "xyz"])

    force = (episode.force - vector("force_bias")) / nuisances.get("force_gain", 1.0)
    late, shift = nuisances.get("force_delay", 0.0), vector("cloud_shift").astype(np.float32)
    sooner = [np.interp(episode.time + late, episode.time, axis) for axis in force.T]
    return replace(
        episode,
        force=np.stack(sooner, axis=1),
        cloud_time=episode.cloud_time - nuisances.get("camera_delay", 0.0),
        clouds=[cloud - shift for cloud in episode.clouds],
    )


def summary(posterior: Posterior, curves: dict) -> dict:
    """Intervals, correlations and residuals, ready for JSON."""
    axes, parameters = posterior.rounds.axes, {}
    for name in (name for name in axes.space.names if name != "air_drag"):
        column = axes.space.names.index(name)
        low, high = interval(posterior.samples[:, column])
        entry = {"low": low, "high": high}
        if name in curves:
            entry["identifiable"] = identifiable(name, low, high, axes)
            entry["profile"] = [curves[name]["low"], curves[name]["high"]]
        else:
            entry |= {"identifiable": False, "fixed": True}
        parameters[name] = entry
    derived = {}
    for name, samples in posterior.derived.items():
        low, high = interval(samples)
        value = float(np.median(samples))
        derived[name] = {"value": value, "low": low, "high": high, "unit": UNITS[name]}
    names = {axes.space.names[i]: posterior.samples[:, i] for i in axes.free}
    return {
        "level": LEVEL,
        "parameters": parameters,
        "derived": derived,
        "correlation": correlation(names | posterior.derived),
        "phases": by_phase(posterior.last.groups),
        "rollouts": posterior.rounds.rollouts,
        "moved": posterior.moved,
        "settled": posterior.settled,
    }


def kept(posterior: Posterior, curves: dict) -> dict:
    """Samples, mean and profile curves, ready for JSON."""
    rows = np.linspace(0, len(posterior.samples) - 1, SAMPLES).astype(int)
    shown = {}
    for name, curve in curves.items():
        good = np.isfinite(curve["misfit"])
        shown[name] = {key: curve[key][good].tolist() for key in ("value", "misfit", "surrogate")}
    return {
        "names": list(posterior.rounds.axes.space.names),
        "samples": posterior.samples[rows].tolist(),
        "mean": posterior.mean.tolist(),
        "profiles": shown,
    }


def by_phase(groups: list[dict]) -> dict:
    """Root mean squares of the residuals, and how many independent ones they are worth.

    `force_rms` [N] is of the vectors; `cloud_rms` [m] is across the band.
    """
    phases = {}
    for phase in PHASES:
        entry = {}
        for kind in ("force", "cloud"):
            mine = [one for one in groups if one["phase"] == phase and one["channel"][:5] == kind]
            if not mine:
                continue
            square = sum(one["count"] * one["rms"] ** 2 for one in mine)
            channels = {one["channel"] for one in mine}
            count = sum(one["count"] for one in mine) / len(channels)
            entry[f"{kind}_rms"] = float(np.sqrt(square / count))
            entry[f"{kind}_independent"] = float(sum(one["independent"] for one in mine))
            entry[f"{kind}_residuals"] = int(sum(one["count"] for one in mine))
        phases[phase] = entry
    return phases
