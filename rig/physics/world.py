"""What the rig is made of, from params.yaml: the band between the fork's tips and its material."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rig.physics.elasticity import law_of
from rig.physics.motion import PULL_LENGTH, pull_history
from rig.physics.rubber import Flow, Rubber, Softening, spectrum
from rig.physics.string import ElasticString

if TYPE_CHECKING:
    from pipeline.params import BandParams, Params
    from pipeline.params.virtual_rig import RigBand, RigSoftening

HISTORY_STEP = 0.01


def string_of(params: Params, band_name: str) -> ElasticString:
    """The band, its modulus such that a virgin one's pull peaks at `rig.bands.<band>.peak_force`.

    A band that is `preconditioned` was drawn so far before, or as far as for the recording.
    """
    rig, setup = params.rig, params.setup
    return _string_of(
        params.bands[band_name],  # pyright: ignore[reportArgumentType]
        rig.bands[band_name],  # pyright: ignore[reportArgumentType]
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
        return ElasticString(
            edges=edges,
            length=band.rest_length,
            diameter=band.diameter,
            mass=band.mass,
            clamps=np.array([[-fork_width / 2, 0.0, 0.0], [fork_width / 2, 0.0, 0.0]]),
            clamp_direction=np.array(clamp_direction),
            rubber=rubber_of(hidden, scale),
        )

    unit = with_scale(1.0)
    path, stretch, relaxed, memory = pulled(unit, np.array([0.0, -PULL_LENGTH, 0.0]))
    total = unit.rubber.response(stretch, memory)[0]
    peak = np.argmax(total)
    # Straight halves pulling along y: a guess that the band's turns at clamps and hand spoil a bit.
    tension = unit.stiffness * total[peak]
    guess = with_scale(hidden.peak_force / (2 * tension))
    drawn = bent_at(guess, path[peak])
    y = guess.at_rest(drawn, tolerance, held=True, memory=memory[peak] / relaxed[peak])
    force = guess.at_middle(y)[1]
    made = with_scale(guess.rubber.scale * hidden.peak_force / force)
    before = band.preconditioned
    drawn = PULL_LENGTH * before if isinstance(before, bool) else before
    return replace(made, worst=float(straight(made, np.array([0.0, -drawn, 0.0]))))


def rubber_of(hidden: RigBand, scale: float) -> Rubber:
    """The band's rubber, with the factor `scale` on its law."""
    listed, wide = np.array(hidden.relaxation, float).reshape(-1, 2), hidden.spectrum
    flow, softening = hidden.flow, hidden.softening
    return Rubber(
        scale,
        listed if wide is None else np.concatenate([listed, spectrum(**dict(wide))]),
        hidden.viscosity,
        law_of(hidden.law, hidden.constants),
        None if flow is None else Flow(**dict(flow)),
        None if softening is None else softening_of(softening),
    )


def softening_of(hidden: RigSoftening) -> Softening:
    by_strain = float(hidden.form == "strain")
    return Softening(hidden.damage, hidden.energy, hidden.growth, strain=by_strain)


def pulled(
    string: ElasticString, drawn: np.ndarray, *times: float | None, again: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The band while its middle is pulled straight from the origin to `drawn` (3,) and held there.

    Its halves are taken as straight, and as unstretched while they are slack.

    Args:
        times: Those of `pull_history`.
        again: The band was pulled for the recording before, and softens no more until it is drawn
            further; all else is forgotten.

    Returns:
        Middle (T, 3), stretch (T,), and of `Rubber.history` the relaxed and the true memories
        (T, M), at equal steps of the pull and the pause.
    """
    path = np.multiply.outer(pull_history(HISTORY_STEP, *times), drawn)
    stretch = straight(string, path)
    worst = float(straight(string, np.array([0.0, -PULL_LENGTH, 0.0]))) if again else 1.0
    worst = max(worst, string.worst)
    return path, stretch, *string.rubber.history(stretch, HISTORY_STEP, worst)


def straight(string: ElasticString, middle: np.ndarray) -> np.ndarray:
    """Stretch of two straight halves that meet at `middle` (..., 3); 1 where they are slack."""
    half = np.linalg.norm(middle - string.clamps[0], axis=-1)
    return np.maximum(half / (string.length / 2), 1.0)


def bent_at(string: ElasticString, middle: np.ndarray) -> np.ndarray:
    """Nodes of two straight halves that meet at `middle` (3,): a guess, shape (nodes, 3)."""
    place = np.append(0, np.cumsum(string.sizes)) / string.length
    part = np.abs(2 * place - 1)[:, None]
    ends = np.repeat(string.clamps, [string.middle, string.nodes - string.middle], axis=0)
    return part * ends + (1 - part) * middle
