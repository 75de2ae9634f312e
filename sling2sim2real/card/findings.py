"""What is known of a band, in the plain numbers that the verdict asks for."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from scipy.special import ndtri

from sling2sim2real.card.inputs import CardInputs, sides
from sling2sim2real.card.verdict import FURTHER, Findings
from sling2sim2real.drawing.names import as_code, as_text
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.phases import NO_UNLOADING, phases_of_hand, unseen
from sling2sim2real.identification.results.ranges import at_edges, searched
from sling2sim2real.launching.trials.spread import LEVEL
from sling2sim2real.quantities import QUANTITIES, rounded

NEARLY = 0.02  # m below the highest that the hand goes: it no longer lifts
SLACK = 0.3  # force along over force across the horizontal, below which the band only hangs
FEWEST = 10  # samples
LIGHTEST = 0.05  # N: a sensor's zero is no surer


def findings(inputs: CardInputs, force: np.ndarray | None = None) -> Findings:
    """Findings of a band, from files and launches.

    Args:
        force: Of the first pull, simulated, at its samples [N], shape (T, 3).
    """
    confidence, aims = inputs.confidence, inputs.aims
    recordings = confidence.get("recordings", [])

    def worst(name: str) -> float:
        return max((recording[name] for recording in recordings), default=0.0)

    launched = inputs.launched
    scored = launched.loc[launched.stretch <= FURTHER * inputs.recorded_stretch]
    scored = scored.loc[scored.predicted_low.notna()]
    landing, low, high = (scored[n] for n in ("landing_y", "predicted_low", "predicted_high"))
    off, share = landing - scored.predicted_y, landing / scored.predicted_y - 1
    evidence = confidence.get("launches", [])
    left = [
        abs(launch["left"][name])
        for launch in evidence
        for name in ("landing", "speed")
        if launch["left"].get(name) is not None
    ]
    miss = np.abs(aims.landing - aims.target)
    widest = int(np.argmax(aims.half_width))
    return Findings(
        cautions=_cautions(inputs.episodes),
        settled=confidence.get("settled"),
        effective=confidence.get("effective_samples"),
        force=worst("force_rms"),
        held=worst("held_rms"),
        recoil=worst("recoil_rms"),
        recoil_seen=any(recording["pictures"] for recording in recordings) or not recordings,
        disagreement=confidence.get("disagreement", 1.0),
        odd=_odd(recordings),
        at_sides=_at_sides(inputs),
        stretch=float(aims.stretch.max()),
        recorded_stretch=inputs.recorded_stretch,
        hold_force=float(np.nanmax(aims.hold_force, initial=0.0)),
        max_force=inputs.params.setup.max_force,
        failures=[
            f"The launch at {target:g} m fails in simulation: {failure}."
            for target, failure in zip(aims.target, aims.failure, strict=True)
            if failure
        ],
        converged=inputs.trained is not False,
        miss=float(np.nanmax(miss, initial=0.0)),
        half_width=float(aims.half_width.max()),
        sides=sides(aims.landing[widest], aims.interval[widest]),
        outside=int(((landing < low) | (landing > high)).sum()),
        scores=len(scored),
        off=_known(off.abs().mean()),
        bias=_known(share.mean()),
        bias_error=_known(share.sem()),
        bias_of_half=_known((2 * off / (high - low)).mean()),
        kind=" and ".join(dict.fromkeys(scored.kind)),
        left=max(left, default=0.0),
        observed=sum(None not in launch["left"].values() for launch in evidence),
        surprising=sum(_outside(launch["z_without_it"].values()) for launch in evidence),
        carried=None if force is None else carried(inputs.episode, force),
        density=_density(inputs),
        unloaded=any(
            NO_UNLOADING not in unseen(phases_of_hand(episode)) for episode in inputs.episodes
        ),
    )


def carried(episode: Episode, force: np.ndarray) -> float | None:
    """Measured over simulated vertical force on the hand that has lifted the slack band.

    Args:
        force: Simulated, at the episode's samples [N], shape (T, 3).
    """
    held = (episode.time > episode.grasp_time) & (episode.time < episode.release_time)
    height = np.where(held, episode.position[:, 2], -np.inf)
    lifted = held & (height > height.max() - NEARLY)
    side = np.linalg.norm(force[:, :2], axis=1)
    slack = lifted & (side < SLACK * np.abs(force[:, 2]))
    if slack.sum() < FEWEST or abs(weight := force[slack, 2].mean()) < LIGHTEST:
        return None
    return float(episode.force[slack, 2].mean() / weight)


def _outside(scores: Collection[float | None]) -> bool:
    """Whether any of a launch's standard scores is beyond what one launch in ten has (Šidák)."""
    beyond = ndtri((1 + LEVEL ** (1 / len(scores))) / 2)
    return any(abs(score) > beyond for score in scores if score is not None)


def _known(value: float) -> float:
    """0 of too few launches."""
    return float(value) if np.isfinite(value) else 0.0


def _density(inputs: CardInputs) -> float | None:
    """Density of a band that somebody weighed [kg/m^3]; None for the rig's."""
    band = inputs.found.band
    volume = np.pi / 4 * band.diameter**2 * band.rest_length
    return None if inputs.virtual else float(band.mass / volume)


def _cautions(episodes: Sequence[Episode]) -> list[tuple[str, str]]:
    """What of each pull's recording costs accuracy, and what to do about it: sentences."""
    cautions = []
    for episode in episodes:
        source = episode.metadata["input"]
        pull = f"pull {source.get('pull', 1)} of {as_code(source['file'])}"
        for caution in episode.cautions:
            cure = as_text(caution["cure"])
            sentences = f"In {pull}, {as_text(caution['what'])}.", f"For {pull}: {cure}."
            cautions.append(sentences)
    return cautions


def _odd(recordings: list[dict]) -> str:
    """File and pull that all others predict worst; "" of fewer than two."""
    predicted = [recording for recording in recordings if "misfit_without" in recording]
    if not predicted:
        return ""
    source = max(predicted, key=lambda recording: recording["misfit_without"])["source"]
    return f"pull {source.get('pull', 1)} of {as_code(source.get('file', '?'))}"


def _at_sides(inputs: CardInputs) -> list[tuple[str, str]]:
    """Searched parameters at an edge of their range: label and which edge."""
    at_sides, ranges = [], searched(inputs.params, inputs.method)
    theta = inputs.theta["theta"]
    for name, side in at_edges(inputs.params, inputs.method, theta).items():
        quantity, box = QUANTITIES[name], ranges[name]
        low, high = (f"{rounded(quantity.factor * x):.6g}" for x in (box.low, box.high))
        words = f"{side} end of its bounds, {low} to {high} {quantity.unit}".strip()
        at_sides.append((quantity.label, words))
    return at_sides
