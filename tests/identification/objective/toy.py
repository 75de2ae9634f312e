"""Toys in closed form: a straight band, moved and pulled."""

from types import SimpleNamespace

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.loss import TERMS, EpisodeLoss

RADIUS, LENGTH, LAYERS = 0.005, 0.4, 25
PERIOD = 0.03
CUTOFF = 35.65
SLING = SimpleNamespace(
    radius=RADIUS, rest_length=LENGTH, edge_lengths=np.full(LAYERS - 1, LENGTH / (LAYERS - 1))
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


def by_spreads(count: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Lines (count, 10, 25, 3) near and far, huge, at a point, crumpled; clouds of all sizes."""
    rng = np.random.default_rng(2)
    sizes = [1, 15, 17, 33, 500, 1000, 1025, 2500, 0, 40]
    lines = np.tile(straight(len(sizes)), (count, 1, 1, 1)) + rng.normal(
        0, 0.003, (count, 1, 25, 3)
    )
    clouds = [
        (lines[0, k][rng.integers(0, 25, size)] + rng.normal(0, 0.01, (size, 3))).astype(np.float32)
        for k, size in enumerate(sizes)
    ]
    clouds[-1][:] = clouds[-1][0]
    for line, spread in zip(lines[1:7], (0.003, 0.03, 0.3, 3.0, 1e4, 1e12), strict=True):
        line += rng.normal(0, spread, (1, 25, 3))
    lines[7] *= 1e-3
    lines[8, :, ::2] = lines[8, :, 1::2].mean(axis=1, keepdims=True)
    return lines, clouds


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


def loss_of(of: Episode, **options) -> EpisodeLoss:
    """The loss of the straight band; all terms weigh alike unless `options` say otherwise."""
    options = {"weights": dict.fromkeys(TERMS, 1.0), "cutoff": CUTOFF, **options}
    return EpisodeLoss(of, radius=RADIUS, rest_edges=SLING.edge_lengths, **options)


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
