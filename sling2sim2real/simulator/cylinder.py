"""A tetrahedral mesh of the band: a cylinder in cross-sections, three tetrahedra a prism."""

from __future__ import annotations

import numpy as np


def cylinder(arc: np.ndarray, diameter: float, rings: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Mesh a straight cylinder along x with one cross-section of vertices at each place of `arc`.

    The section is a centre and `rings` rings of 6, 12, ... vertices, scaled to the circle's area.
    Diagonals run from the lower to the higher index, so that neighbours share them.

    Args:
        arc: Ascending places of the sections along the axis [m], shape (L,).
        diameter: Of the round section [m].

    Returns:
        Rest vertices (L, V, 3) and positively oriented tetrahedra (T, 4), as indices into the
        vertices in row-major order; section after section, V = 1 + 3 rings (rings + 1).
    """
    points, triangles = section(diameter / 2, rings)
    vertices = np.empty((len(arc), len(points), 3))
    vertices[..., 0] = np.asarray(arc)[:, None]
    vertices[..., 1:] = points

    low = np.sort(triangles, axis=1)
    high = low + len(points)
    a, b, c, up = low[:, 0], low[:, 1], low[:, 2], high
    prism = np.stack([[a, b, c, up[:, 2]], [a, b, up[:, 1], up[:, 2]], [a, *up.T]])
    slab = prism.transpose(2, 0, 1).reshape(-1, 4)
    edges = np.diff(vertices.reshape(-1, 3)[slab], axis=1)
    turned = np.linalg.det(edges) < 0
    slab[turned] = slab[turned][:, [0, 2, 1, 3]]
    tetrahedra = np.arange(len(arc) - 1)[:, None, None] * len(points) + slab
    return vertices, tetrahedra.reshape(-1, 4)


def section(radius: float, rings: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 2) and triangles (6 rings^2, 3) of a polygon with the circle's area."""
    points, triangles = [[0.0, 0.0]], []
    for ring in range(1, rings + 1):
        outer, inner = 1 + 3 * ring * (ring - 1), 1 + 3 * (ring - 1) * (ring - 2)
        angle = np.arange(6 * ring) * np.pi / (3 * ring)
        points += (ring / rings * np.stack([np.cos(angle), np.sin(angle)], axis=1)).tolist()
        for sextant in range(6):
            for i in range(ring):
                o0, o1 = (outer + (sextant * ring + j) % (6 * ring) for j in (i, i + 1))
                n0, n1 = (
                    inner + (sextant * (ring - 1) + j) % (6 * (ring - 1)) if ring > 1 else 0
                    for j in (i, i + 1)
                )
                triangles.append([n0, o0, o1])
                if i < ring - 1:
                    triangles.append([n0, o1, n1])
    polygon = 3 * rings * np.sin(np.pi / (3 * rings))
    return radius * np.sqrt(np.pi / polygon) * np.array(points), np.array(triangles)


def volumes(vertices: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Volume of each tetrahedron [m^3], shape (T,)."""
    corners = vertices.reshape(-1, 3)[tetrahedra]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
