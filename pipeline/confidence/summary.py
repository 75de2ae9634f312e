"""How sure θ is, as the theta stage writes it: intervals, correlations, samples, profile curves."""

from __future__ import annotations

import numpy as np

from pipeline.confidence.axes import Axes
from pipeline.confidence.intervals import LEVEL, correlation, identifiable, interval
from pipeline.confidence.posterior import Posterior, fit
from pipeline.confidence.profile import profiles
from pipeline.confidence.residuals import PHASES
from pipeline.episode import Episode
from pipeline.identify.space import Space
from pipeline.signal import cutoff_hz
from pipeline.sling.model import THETA

SAMPLES = 200  # that are kept
UNITS = {"damping_product": "s", "hold_force": "N", "release_time": "s", "camera_delay": "s"}
SLIP = 1.01  # times the least friction that holds the measured force


def confidence(
    params, method: str, episode: Episode, sling, theta: np.ndarray, *, workers: int | None = None
) -> tuple[dict, dict]:
    """What a θ file says under `confidence`, and what data/confidence keeps.

    Args:
        theta: θ* of the method, physical, shape (5,).

    Raises:
        UserError: Too many simulations around θ* fail.
    """
    fixed = set(params.methods[method].fixed)
    peak = np.linalg.norm(episode.force, axis=1).max()
    axes = Axes(Space.of(params.parameters), theta, fixed, SLIP * peak / sling.grip_force)
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    posterior = fit(episode, sling, cutoff, axes, theta, workers=workers)
    curves = profiles(posterior, workers=workers)
    return summary(posterior, curves), kept(posterior, curves)


def summary(posterior: Posterior, curves: dict) -> dict:
    """Intervals, correlations and residuals, ready for JSON."""
    axes, parameters = posterior.rounds.axes, {}
    for column, name in enumerate(THETA):
        low, high = interval(posterior.samples[:, column])
        entry = {"low": low, "high": high}
        if name in curves:
            prior = posterior.rounds.priors.get(name)
            entry["identifiable"] = identifiable(name, low, high, axes, prior)
            entry["profile"] = [curves[name]["low"], curves[name]["high"]]
        else:
            entry |= {"identifiable": False, "fixed": True}
        parameters[name] = entry
    derived = {}
    for name, samples in posterior.derived.items():
        low, high = interval(samples)
        value = float(np.median(samples))
        derived[name] = {"value": value, "low": low, "high": high, "unit": UNITS[name]}
    names = {THETA[i]: posterior.samples[:, i] for i in axes.free}
    return {
        "level": LEVEL,
        "parameters": parameters,
        "derived": derived,
        "correlation": correlation(names | posterior.derived),
        "phases": by_phase(posterior.last.groups),
        "rollouts": posterior.rounds.rollouts,
        "moved": posterior.moved,
    }


def kept(posterior: Posterior, curves: dict) -> dict:
    """Samples, mean and profile curves, ready for JSON."""
    rows = np.linspace(0, len(posterior.samples) - 1, SAMPLES).astype(int)
    shown = {}
    for name, curve in curves.items():
        good = np.isfinite(curve["misfit"])
        shown[name] = {key: curve[key][good].tolist() for key in ("value", "misfit", "surrogate")}
    return {
        "names": list(THETA),
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
