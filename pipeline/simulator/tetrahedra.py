"""What tetrahedra.h knows of its mesh: a section of a centre and a hexagon, three tets a prism."""

from __future__ import annotations

import numpy as np

from pipeline.simulator.cylinder import cylinder, volumes

VERTICES = 7  # of a section
DOFS = 3 * VERTICES
SLAB = np.array([0.0, 1.0])  # places of its two sections [m]
CORNERS = cylinder(SLAB, 1.0)[1]  # of the slab between two sections, shape (18, 4)


def section(radius: float) -> np.ndarray:
    """Places of a section's vertices along its directors a and b [m], shape (VERTICES, 2)."""
    return cylinder(SLAB, 2 * radius)[0][0, :, 1:]


def shares() -> np.ndarray:
    """Share of each vertex in the mass of its section, shape (VERTICES,).

    A quarter of each tetrahedron's mass: as much from the slab before a section as from the one
    after where both are equally long.
    """
    vertices, corners = cylinder(SLAB, 1.0)
    quarter = np.repeat(volumes(vertices, corners), 4)
    mass = np.bincount(corners.ravel(), quarter).reshape(2, VERTICES).sum(axis=0)
    return mass / mass.sum()


def table(radius: float) -> np.ndarray:
    """Numbers of the mesh in the order that tetrahedra.h says, of a slab 1 m long."""
    vertices, corners = cylinder(SLAB, 2 * radius)
    places = vertices.reshape(-1, 3)[corners]
    inverse = np.linalg.inv(places[:, 1:] - places[:, :1])  # columns: gradients of corners 1 to 3
    gradients = np.concatenate([-inverse.sum(axis=2)[:, None], inverse.swapaxes(1, 2)], axis=1)
    parts = (shares(), section(radius), volumes(vertices, corners), gradients)
    return np.concatenate([np.ravel(part) for part in parts])


def sections(nodes: np.ndarray, directors: np.ndarray, radius: float) -> np.ndarray:
    """Vertices (..., L, DOFS) of sections at `nodes` (..., L, 3), with directors (..., L, 6)."""
    pairs = directors.reshape(*nodes.shape[:-1], 2, 3)
    vertices = nodes[..., None, :] + section(radius) @ pairs
    return vertices.reshape(*nodes.shape[:-1], DOFS)
