"""How a band hangs: what its slack shape and force show before it is stretched.

The five elastic parameters leave open how the band leaves its clamps and how stiff it is in
bending (a hose, a braid or a strip is no solid round cylinder). Both matter for the recoil, and the
recording shows them while the band is slack: hanging, lifted, and on its way until it is taut. Two
numbers are fitted to that part alone, before any search: the flexural rigidity E I and the angle at
the clamps.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.phases import taut_time
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters

ANGLES_DEG = (-30.0, 60.0)  # of the clamps, towards the middle of the fork [deg]
RELATIVE_RIGIDITIES = (0.1, 20.0)  # relative to a solid round band
TERM_UNITS = {"geom": 0.1, "force": 0.1}  # 1 mm of shape weighs as much as 0.1 N
SLACK_POISSONS_RATIO = 0.45  # while the band is slack, any will do


def slack_part(episode: Episode) -> Episode:
    """The episode until the band is taut. Raises UserError where it never hangs slack."""
    end = taut_time(episode)
    count, frames = int(np.sum(episode.time < end)), int(np.sum(episode.cloud_time < end))
    if end - episode.grasp_time < 0.3 or frames < 10:
        raise UserError(
            f"episode of {episode.band}: the band is taut within {end - episode.grasp_time:.2f} s"
            " of the grasp; record it from hanging slack"
        )
    return replace(
        episode,
        time=episode.time[:count],
        position=episode.position[:count],
        velocity=episode.velocity[:count],
        force=episode.force[:count],
        opening=episode.opening[:count],
        cloud_time=episode.cloud_time[:frames],
        clouds=episode.clouds[:frames],
        release_time=float(episode.time[count - 1]),
    )


def nominal_young(sling: ClampedBand, episode: Episode) -> float:
    """Young's modulus of the neo-Hookean string that holds the recorded force [Pa].

    Median over the last half second before the release; nearly incompressible, so that the tension
    is E A / 3 (l - 1 / l^2).
    """
    last = (episode.time < episode.release_time - 0.05) & (
        episode.time > episode.release_time - 0.55
    )
    position, force = np.median(episode.position[last], 0), np.median(episode.force[last], 0)
    legs = sling.tips - position
    lengths = np.linalg.norm(legs, axis=1)
    stretch = lengths.sum() / sling.rest_length
    pull = np.linalg.norm((legs / lengths[:, None]).sum(axis=0))
    if stretch < 1.05:
        raise UserError(
            f"episode of {episode.band}: the hand holds the band at {stretch:.2f} of its rest"
            f" length ({sling.rest_length} m); check bands.{episode.band}.rest_length and the"
            " extrinsics"
        )
    tension = np.linalg.norm(force) / pull
    return float(3 * tension / (sling.area * (stretch - stretch**-2)))


@dataclass(frozen=True)
class ClampCalibration:
    """How a slack band hangs, as data/clamps/ has it.

    Attributes:
        clamp_direction, flexural_rigidity: As of a `Mounting`.
        clamp_angle_deg: From the setup's clamp direction.
        relative_rigidity: To a solid round band that holds the recorded force.
        loss: As `setup` says (`solid_and_vertical`; None where that fails), and `fitted`.
    """

    clamp_direction: list[float]
    flexural_rigidity: float
    clamp_angle_deg: float
    relative_rigidity: float
    loss: dict[str, float | None]


def calibrate_clamps(
    params: Settings, sling: ClampedBand, episode: Episode, *, workers: int
) -> ClampCalibration:
    """Fit the clamps' angle and the flexural rigidity to the slack part of an episode.

    Args:
        sling: With the setup's clamp direction, as where the angle is 0.

    Raises:
        UserError: The band never hangs slack, or no simulation of its slack part converges.
    """
    young = nominal_young(sling, episode)
    solid = young * np.pi * sling.radius**4 / 4
    part = slack_part(episode)
    loss = EpisodeLoss.of(params, None, part, sling)
    unit_parameters = Parameters.of(
        sling.law, np.array([young, SLACK_POISSONS_RATIO, 5e-3, 1.0, 1.0])
    )
    held_fast = replace(sling, grip_force=1e6)

    def direction(angle: float) -> np.ndarray:
        turn = Rotation.from_euler("y", -angle, degrees=True)
        return turn.apply(sling.clamp_direction)

    def losses(angle: float, rigidity: np.ndarray) -> np.ndarray:
        """One angle with several rigidities, which share a batch, shape (len(rigidity),)."""
        trial = replace(held_fast, clamp_direction=direction(angle))
        rollouts = interact(
            trial, part, unit_parameters.spread(len(rigidity)), rigidity=solid * rigidity
        )
        terms = loss.terms(rollouts)
        total = sum(terms[name] / unit for name, unit in TERM_UNITS.items())
        return np.where([reason is None for reason in rollouts.failure], total, np.inf)

    def best(angles: np.ndarray, rigidity: np.ndarray) -> tuple[float, float, float]:
        with ThreadPoolExecutor(workers) as pool:
            table = np.array(list(pool.map(lambda angle: losses(angle, rigidity), angles)))
        i, j = np.unravel_index(np.argmin(table), table.shape)
        return float(table[i, j]), float(angles[i]), float(rigidity[j])

    start = float(losses(0.0, np.array([1.0]))[0])
    coarse = best(np.linspace(*ANGLES_DEG, 10), np.geomspace(*RELATIVE_RIGIDITIES, 16))
    for width in (1.0, 0.3):  # finer around the best: 9 degrees and a factor of 3, then a third
        coarse = min(
            coarse,
            best(
                coarse[1] + width * np.linspace(-9, 9, 7),
                coarse[2] * np.geomspace(3**-width, 3**width, 16),
            ),
        )
    value, angle, rigidity = min(coarse, (start, 0.0, 1.0))
    if not np.isfinite(value):
        raise UserError(
            f"episode of {episode.band}: no simulation of its slack part converges; check"
            f" bands.{episode.band} (mass, diameter, rest_length) and the extrinsics"
        )
    return ClampCalibration(
        clamp_direction=direction(angle).tolist(),
        flexural_rigidity=solid * rigidity,
        clamp_angle_deg=angle,
        relative_rigidity=rigidity,
        loss={"solid_and_vertical": start if np.isfinite(start) else None, "fitted": value},
    )
