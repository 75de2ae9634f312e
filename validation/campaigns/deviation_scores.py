"""Settings as the paper has them, one at a time; how near forces and launches are with each."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.episode.episode import Episode
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.launching.trials.stretch import recorded_stretch, stretch_of
from pipeline.params import Params, load
from pipeline.simulator.interaction import interact
from validation import orange
from validation.campaigns.rig_scores import aimed, errors_on_the_rig
from validation.campaigns.runner import PAPER
from validation.density import Calibrated
from validation.effects import AS_IS

SWITCHES = {  # section and values, as the paper has them
    AS_IS: ("method_defaults", {}),
    "mounting: false": ("method_defaults", {"mounting": False}),
    "cloud.sampling: before_filters": ("cloud", {"sampling": "before_filters"}),
    "loss.chamfer: clouds": ("loss", {"chamfer": "clouds"}),
    "force.cutoff_unit: rad/s": ("force", {"cutoff_unit": "rad/s"}),
    "sling.mesh: tetrahedra": ("sling", {"mesh": "tetrahedra"}),
}
MESH = [*SWITCHES][-1]
WORDS = {  # of a row of docs/paper.md
    AS_IS: "nothing: as by default, the cut-off as we read it (0.224 rad per sample)",
    "mounting: false": "clamps not calibrated: `mounting: false`",
    "cloud.sampling: before_filters": "farthest points first: `cloud.sampling: before_filters`",
    "loss.chamfer: clouds": "Chamfer distance of two clouds: `loss.chamfer: clouds`",
    "force.cutoff_unit: rad/s": "the cut-off as printed: `force.cutoff_unit: rad/s`",
    "sling.mesh: tetrahedra": "tetrahedra: `sling.mesh: tetrahedra`",
}


def params_of(band: str, switch: str) -> Params:
    """params.yaml with one setting as the paper has it; for `orange`, with that band."""
    params = load()
    params = orange.with_orange(params) if band == orange.NAME else params
    section, values = SWITCHES[switch]
    if section == "method_defaults":
        methods = {
            name: method.model_copy(update=values) for name, method in params.methods.items()
        }
        return params.model_copy(update={"methods": methods})
    return params.model_copy(update={section: getattr(params, section).model_copy(update=values)})


def forces(band: str, outcome: Calibrated, episode: Episode) -> dict:
    """Peak and rms of the predicted force against the recorded one, and the default's loss."""
    params = params_of(band, AS_IS)
    sling, theta = outcome.sling, outcome.theta
    loss, rollouts = EpisodeLoss.of(params, PAPER, episode, sling), interact(sling, episode, theta)
    if rollouts.failure[0]:
        return {"rollout_failed": rollouts.failure[0]}
    held = (episode.time >= episode.grasp_time) & (episode.time <= episode.release_time)
    real, simulated = episode.force[held], loss.filtered(rollouts)[0][held]
    peaks = [np.linalg.norm(force, axis=1).max() for force in (real, simulated)]
    return {
        "peak_force": peaks[1] / peaks[0] - 1,
        "force_rms_n": np.sqrt(np.mean(np.sum((real - simulated) ** 2, axis=1))),
        "loss": loss.total(loss.terms(rollouts))[0],
    }


def misses(band: str, outcome: Calibrated, seen: Episode, recordings: Path | None) -> dict:
    """Errors of launches at the targets [m]; of `orange`, of predictions of measured launches."""
    params = params_of(band, AS_IS)
    if band != orange.NAME:
        return launches(band, params, aimed(outcome, params, params.trials.targets))
    draws, measured = orange.landings(recordings)
    error = np.abs(outcome(draws).landing_y / measured - 1)
    sizes = params.setup.fork_width, params.bands[band].rest_length
    stretch = stretch_of(np.insert(draws, 0, 0, axis=1), *sizes)
    inside = stretch <= recorded_stretch([seen], *sizes)
    return {"error": error, "miss": np.nanmean(error[inside]), "beyond": np.nanmean(error[~inside])}


def launches(band: str, params: Params, draws: np.ndarray) -> dict:
    """Where draws (T, 2) for the targets land on the rig, without errors."""
    error = errors_on_the_rig(band, params, draws)
    reached = np.isfinite(error).any()
    return {"error": error, "miss": np.nanmean(np.abs(error)) if reached else np.nan}
