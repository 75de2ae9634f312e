"""A synthetic pull-and-release, which needs no recording: a yardstick on a fresh clone.

The first band of params.yaml is grasped where it hangs, lifted, drawn back 0.35 m, held, and let go
at 8.1 of 9 s. What a loss compares with is one simulated band: its filtered force, and points on
its ridge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.episode.episode import Episode
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.simulator.interaction import interact
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import Parameters

DRAW = 0.35  # m
THETA = (2e5, 0.45, 2e-3, 0.5, 0.5)  # of the band that is recorded
GRASP, LIFTED, DRAWN, RELEASE, DURATION = 1.0, 2.0, 6.0, 8.1, 9.0  # s


def yardstick(band, params) -> ClampedBand:
    """A band in pads that let no theta slip, so that every rollout goes on to its end."""
    return replace(ClampedBand.of(band, params.setup, params.sling), grip_force=1e5)


def pull_and_release(band: str, shape, sling: ClampedBand) -> Episode:
    """The yardstick's interaction, with a camera at 30 Hz that sees nothing yet.

    Args:
        shape: params.yaml's `episode`, of which samples are taken.
    """
    t = (np.arange(shape.samples) + 0.5) * DURATION / shape.samples
    hang = np.sqrt(max(sling.rest_length**2 / 4 - sling.half_width**2, 0.0))
    lift, pull = ease(t, GRASP, LIFTED), ease(t, LIFTED, DRAWN)
    position = np.stack([np.zeros_like(t), -DRAW * pull, hang * (lift - 1)], axis=1)
    return unseen(band, t, position, np.arange(1, 30 * DURATION) / 30, GRASP, RELEASE)


def ease(t: np.ndarray, first: float, last: float) -> np.ndarray:
    """From 0 at `first` to 1 at `last`, half a cosine."""
    return 0.5 - 0.5 * np.cos(np.pi * np.clip((t - first) / (last - first), 0, 1))


def unseen(
    band: str,
    time: np.ndarray,
    position: np.ndarray,
    cloud_time: np.ndarray,
    grasp_time: float,
    release_time: float,
) -> Episode:
    """A motion of the hand (T,), (T, 3) whose force and clouds nobody measured."""
    return Episode(
        band=band,
        time=time,
        position=position,
        velocity=np.gradient(position, time, axis=0),
        force=np.zeros_like(position),
        opening=np.full(len(time), np.nan),
        cloud_time=cloud_time,
        clouds=[np.zeros((0, 3), np.float32)] * len(cloud_time),
        grasp_time=grasp_time,
        release_time=release_time,
        camera=np.array([0.8, 0.3, 0.5]),
    )


def recorded_yardstick(params) -> tuple[ClampedBand, Episode]:
    """The first band, pulled and released with THETA, as sensors without noise would record it."""
    band = next(iter(params.bands))
    sling = yardstick(params.bands[band], params)
    episode = pull_and_release(band, params.episode, sling)
    rollout = interact(sling, episode, Parameters.of(sling.law, THETA))
    ridges = [
        _ridge(line, sling.radius, episode.camera, params.cloud.points)
        for line in rollout.center_line[0]
    ]
    episode = replace(episode, clouds=ridges)
    return sling, replace(
        episode, force=EpisodeLoss.plain(params, episode, sling).filtered(rollout)[0]
    )


def _ridge(line: np.ndarray, radius: float, camera: np.ndarray, count: int) -> np.ndarray:
    """Points where a tube around a centre line is nearest to the camera, shape (count, 3)."""
    place = np.linspace(0, len(line) - 1, count)
    nodes = np.arange(len(line))
    points = np.stack([np.interp(place, nodes, axis) for axis in line.T], axis=1)
    towards = camera - points
    points += radius * towards / np.linalg.norm(towards, axis=1, keepdims=True)
    return points.astype(np.float32)
