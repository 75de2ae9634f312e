"""Where a simulation starts: the clamps' frames, a band through given nodes, guesses of statics."""

from __future__ import annotations

import numpy as np

from sling2sim2real.simulator.model import DOFS, ClampedBand


def clamp_tangents(sling: ClampedBand) -> np.ndarray:
    """Unit tangents of the band in the first and the last clamp, shape (2, 3)."""
    first = sling.clamp_direction
    return np.array([first, [first[0], -first[1], -first[2]]])


def fixed_frames(sling: ClampedBand) -> np.ndarray:
    """Directors a, b in the first clamp, the last and the fingers, shape (3, 2, 3).

    a x b points along the band; the fingers hold it along the fork.
    """
    normal = np.array([0.0, 1.0, 0.0])
    frames = []
    for tangent in [*clamp_tangents(sling), np.array([1.0, 0.0, 0.0])]:
        a = normal - (normal @ tangent) * tangent
        if np.linalg.norm(a) < 1e-6:
            a = np.array([0.0, 0.0, 1.0])
        a /= np.linalg.norm(a)
        frames.append([a, np.cross(tangent, a)])
    a, b = frames[1]
    cosine, sine = np.cos(sling.clamp_twist), np.sin(sling.clamp_twist)
    frames[1] = [cosine * a + sine * b, cosine * b - sine * a]
    return np.array(frames)


def _transport(normal: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Carry `normal` (3,) along the smallest rotations from unit `start` (3,) to `end` (..., 3)."""
    axis = np.cross(start, end)
    cosine = (end @ start)[..., None]
    turned = np.cross(axis, normal)
    return normal + turned + np.cross(axis, turned) / np.maximum(1 + cosine, 1e-6)


def _directors(
    sling: ClampedBand, end: int, direction: np.ndarray, stretch: np.ndarray
) -> np.ndarray:
    """Directors (..., 6) of edges along unit `direction` (..., 3), turned from a clamp's frame.

    A stretched edge thins, its volume the same.
    """
    turned = _transport(fixed_frames(sling)[end, 0], clamp_tangents(sling)[end], direction)
    both = np.concatenate([turned, np.cross(direction, turned)], axis=-1)
    return both * stretch[..., None] ** -0.5


def sections_of(sling: ClampedBand, nodes: np.ndarray) -> np.ndarray:
    """Cross-sections (..., L, DOFS) of bands through `nodes` (..., L, 3)."""
    state = np.zeros((*nodes.shape[:-1], DOFS))
    state[..., :3] = nodes
    edges = np.diff(nodes, axis=-2)
    length = np.linalg.norm(edges, axis=-1)
    direction, stretch = edges / length[..., None], length / sling.edge_lengths
    for end, half in enumerate((slice(0, sling.middle), slice(sling.middle, sling.edges))):
        state[..., half, 3:] = _directors(sling, end, direction[..., half, :], stretch[..., half])
    state[..., -1, 3:] = fixed_frames(sling)[1].ravel()
    return state


def hanging_line(
    half_width: float, length: float, arc: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A U below the tips, two legs and a half circle, at places `arc` (L,) along it [m].

    Returns:
        Points (L, 3) [m], and how far the U has turned there [rad], shape (L,).
    """
    leg = max((length - np.pi * half_width) / 2, 0.0)
    turn = np.clip((arc - leg) / (length - 2 * leg), 0, 1) * np.pi
    down = np.minimum(np.minimum(arc, length - arc), leg) + half_width * np.sin(turn)
    return np.stack([-half_width * np.cos(turn), 0 * arc, -down], axis=1), turn


def hanging_guess(sling: ClampedBand) -> np.ndarray:
    """A U below the tips, shape (sections, DOFS)."""
    return sections_of(sling, hanging_line(sling.half_width, sling.rest_length, sling.arc)[0])


def drawn_guess(sling: ClampedBand, draws: np.ndarray) -> np.ndarray:
    """Two straight halves from the tips to each draw (N, 2), shape (N, sections, DOFS)."""
    middle = np.column_stack([np.zeros(len(draws)), draws])
    part = (sling.arc / sling.arc[sling.middle])[: sling.middle + 1, None]
    state = np.zeros((len(draws), sling.sections, DOFS), np.float32)
    halves = slice(0, sling.middle + 1), slice(sling.middle, None)
    for end, (half, tip) in enumerate(zip(halves, sling.tips, strict=True)):
        span = middle - tip
        state[:, half, :3] = tip + (part if end == 0 else part[::-1]) * span[:, None]
        length = np.linalg.norm(span, axis=1)
        direction = span / (length if end == 0 else -length)[:, None]
        stretch = length / (sling.rest_length / 2)
        state[:, half, 3:] = _directors(sling, end, direction, stretch)[:, None]
    state[:, -1, 3:] = fixed_frames(sling)[1].ravel()
    return state
