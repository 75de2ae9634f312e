"""What a method makes of recordings of the virtual rig: landings without noise, and intervals.

Recordings are made once and kept as episodes; a method is run on them by library calls, with the
budget of params.yaml. It sees the recordings alone: the rig is launched after it has ended.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.base.files import write_json
from pipeline.episode.episode import Episode
from pipeline.landing.landing_map import LandingMap
from pipeline.launches.spread import landing_intervals
from pipeline.objective.clamps import calibrate_clamps
from pipeline.objective.evaluate import Evaluator
from pipeline.objective.loss import EpisodeLoss
from pipeline.objective.space import Space
from pipeline.oracle.aim import hit, least_sensitive_draw
from pipeline.oracle.world import World
from pipeline.params.identification import LAWS, LEAST_SQUARES
from pipeline.posterior import identify
from pipeline.posterior.launches import Observed
from pipeline.recording.build import build_episodes
from pipeline.rig.recorder.record import record
from pipeline.search.history import History
from pipeline.search.loop import Free, search
from pipeline.search.optimizers import explorer
from pipeline.sling.launch import launch
from pipeline.sling.material import THETA
from pipeline.sling.model import Sling
from pipeline.sling.theta import at_points
from validation.benchmarks.methods import complete

TARGETS = np.linspace(1.525, 2.325, 9)  # m
MAP = 17, 13  # simulated launches that tell where to seek
WORKERS = os.cpu_count()


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


class Outcome:
    """A method's θ of a band, and its simulator.

    Attributes:
        point, samples: As `at_points` has them, (P,) and (S, P) or None.
    """

    def __init__(self, sling: Sling, point: np.ndarray, samples: np.ndarray | None) -> None:
        self.sling, self.point, self.samples = sling, point, samples

    def __call__(self, draws: np.ndarray, points: np.ndarray | None = None):
        """Launches of draws (N, 2) with θ, or with points (N, P)."""
        points = self.point[None] if points is None else points
        return launch(*at_points(self.sling, points), draws, workers=WORKERS)


def found(
    params,
    method: str,
    sling: Sling,
    episodes: Sequence[Episode],
    observed: Sequence[Observed] = (),
) -> tuple[Outcome, dict]:
    """What a method finds, and says of it: least squares takes all, others the first."""
    about, space = params.methods[method], Space.of_method(params, method)
    loss = EpisodeLoss.of(params, method, episodes[0], sling)
    evaluate = Evaluator(episodes[0], sling, loss, space, workers=WORKERS)
    names = (*THETA, *LAWS[about.law])
    if about.search != LEAST_SQUARES:
        best = complete(params, method, params.optimizer, evaluate).best()
        point = np.array([best[name] for name in names])
        return Outcome(identify.launched(sling, episodes[0]), point, None), {}
    free = Free.of(space, about.fixed)
    count = params.optimizer.population * (params.optimizer.generations + 1)
    history = History(method, space.names)
    design = explorer(about, params.optimizer, len(free.axes), count)
    search(design, evaluate, history, rollouts=count, free=free)
    start = np.array([history.best()[name] for name in names])
    one = identify.identify(
        params, method, sling, episodes, start, observed=observed, workers=WORKERS
    )
    point = one.coordinates.points(one.fit.phi[None])[0]
    told = identify.confidence(one, params.parameters)
    return Outcome(identify.launched(sling, episodes[0]), point, one.points), told


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
