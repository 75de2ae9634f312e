"""What a method makes of recordings of the virtual rig: landings without noise, and intervals.

Recordings are made once and kept as episodes; the rig is launched after a method has ended.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.base.files import write_json
from pipeline.episode.episode import Episode
from pipeline.landing.landing_map import LandingMap
from pipeline.launches.spread import landing_intervals
from pipeline.objective.clamps import calibrate_clamps
from pipeline.objective.loss import EpisodeLoss
from pipeline.oracle.aim import hit, least_sensitive_draw
from pipeline.oracle.world import World
from pipeline.recording.build import build_episodes
from pipeline.rig.recorder.record import record
from pipeline.sling.model import Sling
from validation.density import Outcome

TARGETS = np.linspace(1.525, 2.325, 9)  # m
MAP = 17, 13  # simulated launches that tell where to seek


def recorded(params, band: str, folder: Path) -> Episode:
    """The episode of a recording that the rig makes, clamps beside it; kept in `folder`."""
    mounting = folder / "mounting.json"
    if not mounting.exists():
        raw = folder / f"{band}.mcap"
        raw.parent.mkdir(parents=True, exist_ok=True)
        record(params, band, raw)
        episode = build_episodes(raw, band, params)[0][0]
        raw.unlink()
        episode.save(folder / "episode")
        sling = Sling.of(params.bands[band], params.setup, params.sling, as_rod=True)
        clamps = calibrate_clamps(
            sling, episode, lambda part: EpisodeLoss.plain(params, part, sling), workers=1
        )
        write_json(mounting, clamps)
    return Episode.load(folder / "episode")


def sling_of(params, band: str, method: str, folder: Path) -> Sling:
    """The band as a method takes it, with the clamps of its first recording."""
    mounting = json.loads((folder / "mounting.json").read_text())
    sling = Sling.of(params.bands[band], params.setup, params.sling, mounting)
    return replace(sling, law=params.methods[method].law)


def aimed(outcome: Outcome, params) -> np.ndarray:
    """Draws (T, 2) that a perfect policy would choose for TARGETS; NaN where it finds none."""
    setup = params.setup
    box = {"draw_y": setup.draw_y, "draw_z": setup.draw_z, "max_force": setup.max_force}
    landing_map = LandingMap.simulate(outcome, **box, size=MAP, checks=0)

    def land(draw: np.ndarray) -> float:
        done = outcome(draw[None])
        return float(done.landing_y[0]) if done.failure[0] is None else float("nan")

    starts = [least_sensitive_draw(landing_map, target) for target in TARGETS]
    draws = [
        hit(land, target, start) if np.isfinite(start).all() else start
        for target, start in zip(TARGETS, starts, strict=True)
    ]
    return np.array(draws)


def scored(outcome: Outcome, params, world: World, seed: int = 0) -> dict:
    """Launches at TARGETS in the world: errors without noise, and one launch each with noise.

    Returns:
        "draws" (T, 2); "error" of the landing as a share of the target, without noise; "miss" [m]
        with it; "low", "high" of the 90 % interval and "inside"; NaN where there is none.
    """
    draws = aimed(outcome, params)
    good = np.isfinite(draws).all(axis=1)
    landing, noisy = np.full(len(draws), np.nan), np.full(len(draws), np.nan)
    intervals = np.full((len(draws), 2), np.nan)
    landing[good] = world.exact(draws[good]).landing_y
    numbers = 1000 * (seed + 1) + np.flatnonzero(good)
    noisy[good] = world.landings(draws[good], numbers[:, None])[:, 0]
    if outcome.samples is not None and good.any():
        error = params.trials.actuation_error
        intervals[good] = landing_intervals(outcome, draws[good], outcome.samples, error)
    low, high = intervals.T
    return {
        "draws": draws,
        "error": landing / TARGETS - 1,
        "miss": noisy - TARGETS,
        "low": low,
        "high": high,
        "inside": (noisy >= low) & (noisy <= high),
    }
