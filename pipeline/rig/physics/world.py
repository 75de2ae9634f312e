"""What the rig is made of, from params.yaml: the band between the fork's tips and its material."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from pipeline.rig.physics.motion import PULL_LENGTH, pull_history
from pipeline.rig.physics.rubber import Rubber, nominal_stress
from pipeline.rig.physics.string import ElasticString

if TYPE_CHECKING:
    from pipeline.params import BandParams, Params
    from pipeline.params.virtual_rig import RigBand

HISTORY_STEP = 0.01


def string_of(params: Params, band_name: str) -> ElasticString:
    """The band, its modulus such that the recorded pull peaks at `rig.bands.<band>.peak_force`."""
    rig, setup = params.rig, params.setup
    return _string_of(
        params.bands[band_name],
        rig.bands[band_name],
        setup.fork_width,
        setup.clamp_direction,
        rig.edges,
        rig.tolerance,
    )


@lru_cache
def _string_of(
    band: BandParams,
    hidden: RigBand,
    fork_width: float,
    clamp_direction: tuple[float, float, float],
    edges: int,
    tolerance: float,
) -> ElasticString:
    def with_scale(scale: float) -> ElasticString:
        relaxation = np.array(hidden.relaxation, float).reshape(-1, 2)
        return ElasticString(
            edges=edges,
            length=band.rest_length,
            diameter=band.diameter,
            mass=band.mass,
            clamps=np.array([[-fork_width / 2, 0.0, 0.0], [fork_width / 2, 0.0, 0.0]]),
            clamp_direction=np.array(clamp_direction),
            rubber=Rubber(scale, relaxation, hidden.viscosity),
        )

    unit = with_scale(1.0)
    path, stress, memory = pulled(unit, np.array([0.0, -PULL_LENGTH, 0.0]))
    total = stress + (stress[:, None] - memory) @ unit.rubber.weights
    peak = np.argmax(total)
    # Straight halves pulling along y: a guess that the band's turns at clamps and hand spoil a bit.
    tension = unit.stiffness * total[peak]
    guess = with_scale(hidden.peak_force / (2 * tension))
    drawn = bent_at(guess, path[peak])
    y = guess.at_rest(drawn, tolerance, held=True, memory=memory[peak] / stress[peak])
    force = guess.at_middle(y)[1]
    return with_scale(guess.rubber.scale * hidden.peak_force / force)


def pulled(
    string: ElasticString, drawn: np.ndarray, *times: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The band while its middle is pulled straight from the origin to `drawn` (3,) and held there.

    Its halves are taken as straight, and as unstretched while they are slack. `times` are those of
    `pull_history`.

    Returns:
        Middle (T, 3), elastic stress (T,) and memories (T, K) of Treloar's rubber [MPa], at equal
        steps of the pull and the pause.
    """
    path = np.multiply.outer(pull_history(HISTORY_STEP, *times), drawn)
    half = np.linalg.norm(path - string.clamps[0], axis=1)
    stretch = np.maximum(half / (string.length / 2), 1.0)
    return path, nominal_stress(stretch)[0], string.rubber.memory(stretch, HISTORY_STEP)


def bent_at(string: ElasticString, middle: np.ndarray) -> np.ndarray:
    """Nodes of two straight halves that meet at `middle` (3,): a guess, shape (nodes, 3)."""
    place = np.append(0, np.cumsum(string.sizes)) / string.length
    part = np.abs(2 * place - 1)[:, None]
    ends = np.repeat(string.clamps, [string.middle, string.nodes - string.middle], axis=0)
    return part * ends + (1 - part) * middle
