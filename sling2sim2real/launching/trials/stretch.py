"""How far a band is stretched: what decides how far a law that was fitted to a recording holds."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import held_positions


def stretch_of(points: np.ndarray, fork_width: float, rest_length: float) -> np.ndarray:
    """Length of the straight segments tip - point - tip over the rest length.

    Args:
        points: Where the band is held, frame O [m], shape (N, 3).
    """
    tips = np.array([[-fork_width / 2, 0, 0], [fork_width / 2, 0, 0]])
    return np.linalg.norm(points[:, None] - tips, axis=2).sum(1) / rest_length


def recorded_stretch(episodes: Iterable[Episode], fork_width: float, rest_length: float) -> float:
    """The largest stretch that the recordings show."""
    return float(stretch_of(held_positions(episodes), fork_width, rest_length).max())
