"""Toys in closed form: a straight band, moved and pulled; a loss that is a quadratic function."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from pipeline.episode import Episode
from pipeline.identify.evaluate import Evaluation
from pipeline.identify.explore import explore
from pipeline.identify.history import History
from pipeline.identify.loss import TERMS
from pipeline.identify.refine import refine
from pipeline.identify.regions import Region, find_regions

RADIUS, LENGTH, LAYERS = 0.005, 0.4, 25
PERIOD = 0.03
CUTOFF = 35.65
SLING = SimpleNamespace(
    radius=RADIUS, rest_length=LENGTH, edge_lengths=np.full(LAYERS - 1, LENGTH / (LAYERS - 1))
)

NAMES = ("a", "b", "c", "d", "e")
CENTRE = np.array([0.3, 0.62, 0.45, 0.8, 0.55])
BUDGET = SimpleNamespace(
    seed=1,
    population=24,
    generations=12,
    mutation=(0.5, 1.0),
    recombination=0.7,
    k_top=5,
    k_nn=15,
    delta=0.1,
    cma_population=8,
    cma_rollouts=320,
)


def straight(frames: int, layers: int = LAYERS) -> np.ndarray:
    """Centre lines along x through the origin, unstretched, shape (frames, layers, 3)."""
    line = np.zeros((frames, layers, 3))
    line[..., 0] = np.linspace(-LENGTH / 2, LENGTH / 2, layers)
    return line


def facing(points: int = 2000) -> np.ndarray:
    """Points on the ridge of `straight` that faces a camera far up along z, shape (points, 3)."""
    cloud = np.zeros((points, 3))
    cloud[:, 0] = np.linspace(-LENGTH / 2, LENGTH / 2, points)
    cloud[:, 2] = RADIUS
    return cloud


def episode(samples: int = 60, frames: int = 20, **changes) -> Episode:
    """A hand that moves along y at 0.1 m/s and feels nothing, seen from far above."""
    time = PERIOD * (np.arange(samples) + 0.5)
    content = {
        "band": "toy",
        "time": time,
        "position": np.outer(time, [0, 0.1, 0]),
        "velocity": np.tile([0, 0.1, 0], (samples, 1)),
        "force": np.zeros((samples, 3)),
        "opening": np.full(samples, np.nan),
        "cloud_time": np.linspace(0, samples * PERIOD, frames),
        "clouds": [facing() for _ in range(frames)],
        "grasp_time": 0.3,
        "release_time": 1.2,
        "camera": np.array([0.0, 0.0, 1e4]),
    }
    return Episode(**{**content, **changes})


def rollouts(of: Episode, count: int = 1, shift=(0, 0, 0), force=(0, 0, 0)) -> SimpleNamespace:
    """`count` equal rollouts: the straight band shifted by `shift`, and a constant force."""
    end = of.time[-1] + PERIOD / 2
    times = np.concatenate([np.linspace(0, 1, 80), np.linspace(1.001, end, 300)])
    return SimpleNamespace(
        times=times,
        force=np.tile(np.asarray(force, float), (count, len(times), 1)),
        cloud_time=of.cloud_time,
        center_line=np.tile(straight(len(of.clouds)) + shift, (count, 1, 1, 1)).astype(np.float32),
        failure=[None] * count,
    )


def quadratic(centre: np.ndarray, matrix: np.ndarray, fails=lambda unit: unit[:, 0] < 0):
    """An evaluator whose loss is 1 + (u - centre)' matrix (u - centre) in the unit cube."""

    def evaluate(unit: np.ndarray) -> Evaluation:
        gap = unit - centre
        total = 1 + np.einsum("ni,ij,nj->n", gap, matrix, gap)
        failed = fails(unit)
        total = np.where(failed, np.inf, total)
        terms = {name: np.where(failed, np.nan, total) for name in TERMS}
        return Evaluation(unit, 10 * unit, terms, total, ["no" if bad else None for bad in failed])

    return evaluate


def budget(**changes) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(BUDGET), **changes})


def correlated() -> np.ndarray:
    """Matrix of a valley: two pairs that nearly trade off, as E and nu or s and d do."""
    matrix = np.diag([40.0, 40.0, 30.0, 30.0, 10.0])
    matrix[0, 1] = matrix[1, 0] = 38.0
    matrix[2, 3] = matrix[3, 2] = -27.0
    return matrix


def chain(evaluate, optimizer=BUDGET) -> tuple[History, History, list[Region]]:
    """Explore, find regions, refine: both histories and the regions."""
    explored, refined = History("toy", NAMES), History("toy", NAMES)
    explore(evaluate, optimizer, explored)
    regions = find_regions(
        explored.unit,
        explored.total,
        k_top=optimizer.k_top,
        k_nn=optimizer.k_nn,
        delta=optimizer.delta,
    )
    refine(evaluate, regions, optimizer, refined)
    return explored, refined, regions
