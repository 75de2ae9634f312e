"""The rod's energy in plain NumPy, float64, written from the equations at the head of rod.h."""

from __future__ import annotations

import numpy as np

from pipeline.sling.model import GRAVITY, fixed_frames, material


def energy(sling, theta, layers: np.ndarray) -> float:
    """Elastic and gravitational energy [J] of one band in state `layers` (L, 9)."""
    mu, lam, _, _, _, bending = material(sling, np.array([theta]))[0]
    torsion, ds, area = sling.radius**2 / 4, sling.edge_lengths, sling.area
    nodes, a, b = layers[:, :3], layers[:-1, 3:6], layers[:-1, 6:9]
    g = np.diff(nodes, axis=0) / ds[:, None]
    volume_ratio = np.einsum("ij,ij->i", g, np.cross(a, b))
    squares = (g**2 + a**2 + b**2).sum(axis=1)
    density = mu / 2 * (squares - 3) - mu * (volume_ratio - 1) + lam / 2 * (volume_ratio - 1) ** 2
    total = (density * area * ds).sum()
    frames = fixed_frames(sling)[:2]
    a = np.vstack([frames[:1, 0], a, frames[1:, 0]])
    b = np.vstack([frames[:1, 1], b, frames[1:, 1]])
    apart = (np.append(ds, 0) + np.append(0, ds)) / 2  # of two edges' middles; half to a clamp
    twist = ((a[1:] * b[:-1]).sum(1) - (b[1:] * a[:-1]).sum(1)) / 2
    bend = ((a[1:] - a[:-1]) ** 2 + (b[1:] - b[:-1]) ** 2).sum(1)
    joints = (bending * bend - 2 * (bending - torsion) * twist**2) / apart
    total += joints.sum() * mu * area / 2
    return total + GRAVITY * sling.mass / sling.rest_length * (apart * nodes[:, 2]).sum()


def gradient(sling, theta, layers: np.ndarray) -> np.ndarray:
    """Central differences of `energy`, shape (L, 9)."""
    result = np.zeros_like(layers)
    for index in np.ndindex(layers.shape):
        sides = []
        for step in (1e-6, -1e-6):
            moved = layers.copy()
            moved[index] += step
            sides.append(energy(sling, theta, moved))
        result[index] = (sides[0] - sides[1]) / 2e-6
    return result
