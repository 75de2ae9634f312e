"""Synthetic episodes, which need no recording: a pull, and what sensors would see of it.

The first band of params.yaml is grasped where it hangs, lifted, drawn back 0.35 m, held, and let go
at 8.1 of 9 s. As a yardstick on a fresh clone, a loss compares with one simulated band: its
filtered force, and points on its ridge. Of the simulator's own law, an episode is truth for an
identification without an error of the model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.params import Params
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.signal import average, cutoff_hz, lowpass, uniform
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.replay import recorded_force

DRAW = 0.35  # m
THETA = (2e5, 0.45, 2e-3, 0.5, 0.5)  # of the band that is recorded
GRASP, LIFTED, DRAWN, RELEASE, DURATION = 1.0, 2.0, 6.0, 8.1, 9.0  # s
RATE = 1000.0  # of the force sensor [Hz]
ALONG, AROUND = 400, 16  # points of the band's surface before a camera sees them
POINTS = 1000  # of a cloud


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
    """Rise from 0 at `first` to 1 at `last`, half a cosine."""
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


def recorded_yardstick(params: Params) -> tuple[ClampedBand, Episode]:
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
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    return sling, replace(episode, force=recorded_force(rollout, episode, cutoff)[0])


def _ridge(line: np.ndarray, radius: float, camera: np.ndarray, count: int) -> np.ndarray:
    """Points where a tube around a centre line is nearest to the camera, shape (count, 3)."""
    place = np.linspace(0, len(line) - 1, count)
    nodes = np.arange(len(line))
    points = np.stack([np.interp(place, nodes, axis) for axis in line.T], axis=1)
    towards = camera - points
    points += radius * towards / np.linalg.norm(towards, axis=1, keepdims=True)
    return points.astype(np.float32)


def own_law_episode(
    sling: ClampedBand,
    episode: Episode,
    theta: Parameters,
    *,
    cutoff: float,
    force_noise: float = 0.05,
    depth_noise: float = 0.0006,
    seed: int = 0,
) -> Episode:
    """What would have been recorded, had the band of this episode the simulator's law and theta.

    Args:
        theta: One sample.
        cutoff: Of the low-pass of params.force [Hz].
        force_noise: Standard deviation of one sample at 1 kHz [N].
        depth_noise: Standard deviation at 1 m, growing with the square of the distance [m].
    """
    rng = np.random.default_rng(seed)
    rollout = interact(sling, episode, theta)
    if rollout.failure[0]:
        raise ValueError(f"theta fails: {rollout.failure[0]}")
    times, force = uniform(rollout.times, np.asarray(rollout.force[0], float), RATE)
    force = lowpass(force + rng.normal(0, force_noise, force.shape), RATE, cutoff)
    start = episode.time[0] - episode.sample_period / 2
    return replace(
        episode,
        force=average(times, force, start, episode.sample_period, len(episode.time)),
        clouds=[
            visible(line, sling.edge_lengths, sling.radius, episode.camera, depth_noise, rng)
            for line in rollout.center_line[0]
        ],
    )


def visible(
    line: np.ndarray,
    sizes: np.ndarray,
    radius: float,
    camera: np.ndarray,
    noise: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """Points of the side of an incompressible tube that faces the camera, shape (P, 3), float32.

    Args:
        line: Its nodes [m], shape (M, 3).
        sizes: Lengths of its edges at rest [m], shape (M - 1,).
        radius: At rest [m].
    """
    line = np.asarray(line, float)
    edges = np.linalg.norm(np.diff(line, axis=0), axis=1)
    place = np.append(0, np.cumsum(edges))
    at = np.sort(rng.uniform(0, place[-1], ALONG))
    centre = np.stack([np.interp(at, place, axis) for axis in line.T], axis=1)
    edge = np.clip(np.searchsorted(place, at) - 1, 0, len(edges) - 1)
    tangent = (np.diff(line, axis=0) / edges[:, None])[edge]
    radius = radius * np.sqrt(sizes / edges)[edge]
    towards = camera - centre
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    side = np.cross(tangent, towards)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    front = np.cross(side, tangent)
    angle = rng.uniform(-np.pi / 2, np.pi / 2, (ALONG, AROUND, 1))
    normal = np.cos(angle) * front[:, None] + np.sin(angle) * side[:, None]
    points = (centre[:, None] + radius[:, None, None] * normal).reshape(-1, 3)
    ray = points - camera
    distance = np.linalg.norm(ray, axis=1, keepdims=True)
    points = points + ray / distance * rng.normal(0, noise, distance.shape) * distance**2
    return rng.permutation(points)[:POINTS].astype(np.float32)
