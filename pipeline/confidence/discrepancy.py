"""How far the model's law is from the rubber's where a launch feels it, from the recording alone.

Samples of θ say where a law that is right would land the projectile. One that is not misses besides
by what it gets wrong of the energy: a landing goes about with the energy that leaves the band. Two
parts of it show themselves in the recording.

    energy   the work of the hand from grasp to release: measured less simulated, over measured
    recoil   distance of the recoiling band from the simulated one beyond noise, over the way that
             its middle has travelled, which goes with the speed: twice as much energy

They are added in quadrature, as one standard deviation of a landing. Limits: what the hysteresis of
the pull takes counts as an error, though a launch may not miss it; a clock that is off counts as an
error of the recoil; the recorded recoil carries no projectile; a loss that weighs work makes its
gap small by fitting it; and a recoil that no picture shows says nothing.
"""

from __future__ import annotations

import numpy as np

from pipeline.confidence.residuals import Residuals
from pipeline.confidence.whitening import noise_variance
from pipeline.episode.episode import Episode
from pipeline.sling.interaction import interact
from pipeline.sling.theta import at_points


def discrepancy(
    episode: Episode, sling, cutoff: float, theta: np.ndarray
) -> dict[str, float | None]:
    """Shares, one standard deviation each: "energy", "recoil" (None without one) and "landing".

    Args:
        cutoff: Of the low-pass that the recorded force went through [Hz].
        theta: θ*, and the air's drag where it is searched, shape (5,) or (6,).
    """
    windy, thetas = at_points(sling, theta[None])
    rollouts = interact(windy, episode, thetas)
    line = rollouts.center_line[0]
    residuals = Residuals(episode, sling, cutoff, line)
    energy = energy_gap(episode, residuals.force(rollouts)[0])
    recoil = recoil_gap(residuals, residuals(rollouts)[0], episode, line)
    landing = float(np.hypot(energy, 2 * (recoil or 0.0)))
    return {"energy": energy, "recoil": recoil, "landing": landing}


def energy_gap(episode: Episode, force: np.ndarray) -> float:
    """|work measured - work simulated| / work measured, of the hand from grasp to release.

    Args:
        force: Simulated, filtered as the recorded one [N], shape (T, 3).
    """
    held = (episode.time > episode.grasp_time) & (episode.time < episode.release_time)
    power = np.einsum("tc,tc->t", episode.force, episode.velocity)[held]
    gap = np.einsum("tc,tc->t", episode.force - force, episode.velocity)[held]
    return float(abs(gap.sum() / power.sum()))


def recoil_gap(
    residuals: Residuals, residual: np.ndarray, episode: Episode, line: np.ndarray
) -> float | None:
    """Root mean square distance beyond noise over that of the way; None where no picture shows it.

    The noise is that of the held band, fully drawn; none where no picture shows it.

    Args:
        residual: Of all channels, shape (R,).
        line: Simulated centre lines [m], shape (K, L, 3).
    """
    square, way = 0.0, 0.0
    middle = line[:, line.shape[1] // 2]
    start = np.array(
        [np.interp(episode.release_time, episode.time, axis) for axis in episode.position.T]
    )
    noise = {  # sorted by part: the fully drawn one comes last
        group.channel: noise_variance(group, residual)
        for group in residuals.groups
        if group.phase == "taut"
    }
    for group in residuals.groups:
        if group.phase == "recoil" and group.channel.startswith("cloud"):
            beyond = residual[group.rows] ** 2 - np.nan_to_num(noise.get(group.channel, 0.0))
            square += np.sum(beyond)
            travelled = np.linalg.norm(middle[group.grid[:, 0]] - start, axis=1)
            way += np.sum(travelled**2) / 2  # a point has two channels
    return float(np.sqrt(max(square, 0.0) / way)) if way > 0 else None
