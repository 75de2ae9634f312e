"""Samples of the posterior as parameters of an exported chain, for domain randomisation.

A match takes a minute, so it is made once, for the best θ, and carried to the samples: how the
matched chain's hold forces and landings change with its parameters is measured around the match.
A sample's change of both in the calibrated simulation is then solved for its parameters, by linear
least squares. Three samples are replayed in the engine, which says what that is worth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing
from sling2sim2real.exporting.chain import Shot, SpringChain
from sling2sim2real.exporting.match import (
    HOLD_LIMIT,
    LANDING_LIMIT,
    compared,
    draws_of,
    within_limits,
)
from sling2sim2real.exporting.mujoco_replay import MujocoBand
from sling2sim2real.exporting.newton_replay import NewtonReplay
from sling2sim2real.quantities import rounded
from sling2sim2real.simulator.launch import Launches

FILE = "samples.parquet"
STEPS = np.diag([0.02, 0.02, 0.1])  # by which _moved measures it
REPLAYED = 3  # from the weakest to the strongest
FEWEST = 4  # draws of a sample that land


def expect(model: Model, count: int, to: str) -> None:
    """Raises UserError where so many samples cannot be written for an engine."""
    sampled = getattr(model, "sampled", None)
    there = 0 if sampled is None else len(sampled)
    if count and to == "usd":
        raise UserError("samples: only for mjcf and newton, whose match is carried to samples")
    if not 0 <= count <= there:
        hint = "" if there else "; `sling fit` makes them"
        raise UserError(
            f"samples: must be from 0 to {there}, which the band has, got {count}{hint}"
        )


def write(
    model: Model,
    chain: SpringChain,
    folder: Path,
    count: int,
    *,
    replay: Callable[[SpringChain], MujocoBand | NewtonReplay],
    columns: Callable[[SpringChain], Mapping],
    proof: np.ndarray,
) -> dict | None:
    """Write samples.parquet: a row a sample, its θ as `theta_...` and `columns` of its chain.

    Args:
        chain: Matched to the best θ.
        count: Of samples, evenly from those that there are.
        replay: A chain in the engine.
        proof: Draws (N, 2) of the replay.

    Returns:
        What the card says of it: the worst relative errors of three samples; None of none.
    """
    sampled = getattr(model, "sampled", None)
    if not count or sampled is None:
        return None
    points = sampled.values[np.linspace(0, len(sampled) - 1, count).astype(int)]
    chains = carried(model, chain, points)
    rows = [
        {f"theta_{name}": value for name, value in zip(sampled.names, point, strict=True)}
        | dict(columns(one))
        for point, one in zip(points, chains, strict=True)
    ]
    with replacing(folder / FILE) as temporary:
        pd.DataFrame(rows).to_parquet(temporary, index=False)
    by_strength = np.argsort([one.strength for one in chains])
    replayed, met = [], True
    for number in by_strength[np.linspace(0, count - 1, min(REPLAYED, count)).astype(int)]:
        launched = replay(chains[number]).launches(proof)
        rows_of_draws = compared(model, proof, launched, points[number])
        worst = {
            f"{name}_error": rounded(max((row.errors[name] for row in rows_of_draws), key=abs), 4)
            for name in ("hold_force", "landing")
        }
        replayed.append({"sample": int(number), **worst})
        met = met and within_limits(rows_of_draws)
    return {"count": count, "replayed": replayed, "met": met}


def carried(model: Model, chain: SpringChain, points: np.ndarray) -> list[SpringChain]:
    """The chain of each θ of `points` (M, P), by the sensitivity of the matched one."""
    draws, ours = draws_of(model)
    there, best = _told(MujocoBand(chain).launches(draws)), _told(ours)
    slopes = np.stack(
        [
            (_told(MujocoBand(_moved(chain, step)).launches(draws)) / there - 1) / step.sum()
            for step in STEPS
        ],
        axis=1,
    )
    limits = np.repeat([HOLD_LIMIT, LANDING_LIMIT], len(draws))
    theirs = model.launches(np.tile(draws, (len(points), 1)), np.repeat(points, len(draws), axis=0))
    result = []
    for number in range(len(points)):
        ratio = _told(theirs[np.arange(len(draws)) + number * len(draws)]) / best
        known = np.isfinite(ratio) & np.isfinite(slopes).all(axis=1)
        if known.sum() < 2 * FEWEST:
            raise UserError(f"samples: launches of sample {number} fail; export without samples")
        weight = 1 / (limits * ratio)[known]
        step = np.linalg.lstsq(slopes[known] * weight[:, None], (ratio[known] - 1) * weight)[0]
        moved = _moved(chain, step)
        result.append(replace(moved, step=min(chain.step, moved.stable_step)))
    return result


def _told(launched: Launches | Sequence[Shot]) -> np.ndarray:
    """Hold forces, then landings, shape (2 N,)."""
    if isinstance(launched, Launches):
        return np.append(launched.hold_force, launched.landing_y)
    return np.array([[shot.hold_force, shot.landing] for shot in launched]).T.ravel()


def _moved(chain: SpringChain, step: np.ndarray) -> SpringChain:
    """The chain a step (3,) away: of K and K m in K, of log tau.

    Pull and stored energy are linear in K and K m, so that far samples are carried well too.
    """
    strength = 1 + step[0]
    return replace(
        chain,
        strength=float(chain.strength * strength),
        mooney_share=float((chain.mooney_share + step[1]) / strength),
        damping_time=float(chain.damping_time * np.exp(step[2])),
    )
