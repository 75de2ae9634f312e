"""The band as tetrahedra between its clamps, as both peers take it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.simulator.cylinder import cylinder, volumes
from sling2sim2real.simulator.initial import fixed_frames, hanging_line
from sling2sim2real.simulator.model import ClampedBand

CLAMPED_LENGTH_M = 0.015  # m of band in each clamp
EDGES, GRADING = 48, 6.0  # 50 intervals with those in the clamps: 900 tetrahedra


@dataclass(frozen=True)
class Tube:
    """A tetrahedral band of `shape` (sections, V, 3), row-major.

    The outermost two sections on each side lie in the clamps. Clamps, fingers and pouch hold whole
    sections, which then neither turn nor deform.

    Attributes:
        rest: Vertices of the straight band at rest [m], `shape`.
        tetrahedra: Indices into the vertices, shape (T, 4).
        mass: Of each vertex, a quarter of what its tetrahedra weigh [kg], shape (sections V,).
        hanging: A smooth U of unstretched band to start from, `shape`.
        clamped: `hanging` with the clamped sections where the clamps hold them, `shape`.
        arc: Places of the sections between the clamps [m].
    """

    rest: np.ndarray
    tetrahedra: np.ndarray
    mass: np.ndarray
    hanging: np.ndarray
    clamped: np.ndarray
    arc: np.ndarray

    @classmethod
    def of(
        cls, sling: ClampedBand, edges: int = EDGES, grading: float = GRADING, rings: int = 1
    ) -> Tube:
        """Mesh a sling's band.

        Args:
            edges: Even number of intervals between the clamps.
            grading: How much shorter they are at the clamps and in the hand than midway.
            rings: Of vertices in the section.
        """
        steps = sling.steps.model_copy(update={"grading": grading})
        arc = replace(sling, edges=edges, steps=steps).arc
        whole = np.concatenate([[-CLAMPED_LENGTH_M], arc, [sling.rest_length + CLAMPED_LENGTH_M]])
        rest, tetrahedra = cylinder(whole, 2 * sling.radius, rings)
        share = np.repeat(volumes(rest, tetrahedra) / 4, 4)
        density = sling.mass / (sling.area * sling.rest_length)
        hanging = _hanging(sling, whole, rest)
        clamped, frames = hanging.copy(), fixed_frames(sling)
        for sections, tip, (a, b), start in (
            (slice(0, 2), sling.tips[0], frames[0], 0.0),
            (slice(-2, None), sling.tips[1], frames[1], sling.rest_length),
        ):
            axes = np.array([np.cross(a, b), a, b])
            clamped[sections] = tip + (rest[sections] - [start, 0.0, 0.0]) @ axes
        mass = density * np.bincount(tetrahedra.ravel(), share)
        return cls(rest, tetrahedra, mass, hanging, clamped, arc)

    @property
    def middle(self) -> int:
        """The section in the hand."""
        return len(self.rest) // 2

    @property
    def ends(self) -> np.ndarray:
        """Nodes in the clamps, shape (E,)."""
        return self._rows[[0, 1, -2, -1]].ravel()

    @property
    def hand(self) -> np.ndarray:
        """Nodes of the section in the hand, shape (V,)."""
        return self._rows[self.middle]

    @property
    def _rows(self) -> np.ndarray:
        return np.arange(self.mass.size).reshape(self.rest.shape[:2])


def _hanging(sling: ClampedBand, arc: np.ndarray, rest: np.ndarray) -> np.ndarray:
    center, turn = hanging_line(sling.half_width, sling.rest_length, arc)
    inward = np.stack([np.cos(turn), 0 * arc, np.sin(turn)], axis=1)  # tangent x (0, 1, 0)
    return center[:, None] + rest[..., 1:2] * [0.0, 1.0, 0.0] + rest[..., 2:] * inward[:, None]
