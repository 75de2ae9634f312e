"""Hands that are led along knots of time and drawn distance, at rest at each: exact truth."""

from __future__ import annotations

import numpy as np

from sling2sim2real.episode.episode import Episode
from tests.identification.objective import toy

GRASP, LIFTED, HANGING, TAUT = 0.5, 1.2, 0.195, 0.22  # s, s, m, m
MONOTONE = ((1.2, 0.0), (4.2, 0.4), (6.2, 0.4))
DIP = ((1.2, 0.0), (5.2, 0.4), (6.2, 0.3), (7.2, 0.4), (9.2, 0.4))
FAST = ((1.2, 0.0), (5.2, 0.4), (5.45, 0.3), (5.7, 0.4), (7.7, 0.4))
ON_THE_WAY = ((1.2, 0.0), (3.2, 0.3), (4.2, 0.24), (5.2, 0.3), (6.5, 0.4), (8.0, 0.4))
CYCLES = (
    (1.2, 0.0), (3.2, 0.4), (5.2, 0.0), (7.2, 0.4), (9.2, 0.0), (12.2, 0.4), (14.2, 0.4)
)  # fmt: skip


def eased(x: np.ndarray) -> np.ndarray:
    """A cubic from 0 to 1, at rest at both ends."""
    part = np.clip(x, 0, 1)
    return part**2 * (3 - 2 * part)


def drawn(time: np.ndarray, knots: tuple[tuple[float, float], ...]) -> np.ndarray:
    """Distance [m] at times (T,)."""
    way = np.full(len(time), knots[0][1])
    for (begin, low), (end, high) in zip(knots[:-1], knots[1:], strict=True):
        way += (high - low) * eased((time - begin) / (end - begin))
    return way


def episode(
    knots: tuple[tuple[float, float], ...], noise: float = 0.0, wander: float = 0.0
) -> Episode:
    """A band of 60 N/m beyond TAUT, 0.3 N heavy, let go at the last knot's time.

    Args:
        noise: Standard deviation of a tracked place [m].
        wander: Of the hand about its path, at some 0.3 Hz [m].
    """
    release = knots[-1][0]
    time = toy.PERIOD * (np.arange(int((release + 1.0) / toy.PERIOD)) + 0.5)
    random = np.random.default_rng(0)
    way = drawn(time, knots) + wander * np.sin(2.1 * time)
    hanging = HANGING * (1 - eased((time - GRASP - 0.1) / (LIFTED - GRASP - 0.2)))
    place = np.stack([0 * time, -way, -hanging], axis=1)
    force = np.zeros_like(place)
    force[:, 1] = 60 * np.maximum(way - TAUT, 0)
    force[:, 2] = -0.3
    force[(time < GRASP) | (time > release)] = 0
    return toy.episode(
        samples=len(time),
        position=place + noise * random.normal(size=place.shape),
        velocity=np.gradient(place, toy.PERIOD, axis=0),
        force=force + 0.005 * random.normal(size=force.shape),
        grasp_time=GRASP,
        release_time=release,
    )
