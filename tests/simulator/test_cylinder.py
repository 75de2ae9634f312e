"""The tetrahedral mesh fills the cylinder once, without gaps."""

from collections import Counter

import numpy as np
import pytest

from sling2sim2real.simulator.cylinder import cylinder, section, volumes


def test_mesh_fills_the_round_band_and_neighbours_share_faces():
    for rings in (1, 2, 3):
        vertices, tets = cylinder(np.linspace(0, 0.55, 21), 0.010, rings)
        volume = volumes(vertices, tets)
        assert volume.min() > 0
        assert volume.sum() == pytest.approx(np.pi * 0.005**2 * 0.55)
        faces = Counter(tuple(sorted(np.delete(tet, k))) for tet in tets for k in range(4))
        outside = 2 * 6 * rings * 20 + 2 * 6 * rings**2  # of the hull and of both ends
        assert Counter(faces.values()) == {1: outside, 2: (4 * len(tets) - outside) // 2}


def test_section_bends_like_a_circle():
    points, triangles = section(0.005)
    corners = points[triangles]
    area = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2
    # second moment of a triangle: area / 12 (sum of squares + square of the sum)
    squares = (corners**2).sum(axis=1) + corners.sum(axis=1) ** 2
    moments = (area[:, None] / 12 * squares).sum(axis=0)
    assert moments == pytest.approx(np.full(2, np.pi * 0.005**4 / 4), rel=0.01)
