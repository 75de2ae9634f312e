"""What the camera sees: triangle meshes of the fork, the room, the robot and the band, frame O."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.physics.robot import Robot

ROD, CLAMP = 0.02, 0.03  # widths of the fork's rods and of the clamps at its tips [m]
SIDES = 12  # of the band's tube
SHOULDER, LINK, WRIST = 0.33, 0.42, 0.25  # of the arm: height, lengths of two links, hand to wrist

FORK_COLOR = (0.62, 0.63, 0.65)
FLOOR_COLOR = (0.42, 0.39, 0.36)
TILE_COLOR = (0.33, 0.31, 0.29)
WALL_COLOR = (0.58, 0.60, 0.57)
ROBOT_COLOR = (0.90, 0.90, 0.88)
FINGER_COLOR = (0.30, 0.30, 0.30)
PEDESTAL_COLOR = (0.20, 0.20, 0.21)
TILE = 0.4

_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
_FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


@dataclass(frozen=True)
class Mesh:
    """Triangles of one or more colours.

    Attributes:
        vertices: Shape (V, 3) [m].
        triangles: Indices, shape (F, 3).
        colors: Of each triangle, 0 to 1, shape (F, 3).
    """

    vertices: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray


def joined(meshes: list[Mesh]) -> Mesh:
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([m.triangles + start for m, start in zip(meshes, starts, strict=True)]),
        np.concatenate([mesh.colors for mesh in meshes]),
    )


def box(
    size: tuple, center: Sequence[float] | np.ndarray, color: tuple, axes: np.ndarray | None = None
) -> Mesh:
    """A box of edge lengths `size` (3,) along the columns of `axes` (3, 3)."""
    axes = np.eye(3) if axes is None else axes
    vertices = np.asarray(center) + (_CORNERS * size) @ axes.T
    return Mesh(vertices, _FACES, np.tile(color, (len(_FACES), 1)))


def beam(start: np.ndarray, end: np.ndarray, width: float, color: tuple) -> Mesh:
    """A box of square section from one point to another in the plane x = const."""
    along = (end - start) / np.linalg.norm(end - start)
    side = np.array([1.0, 0.0, 0.0])
    axes = np.stack([side, np.cross(along, side), along], axis=1)
    length = np.linalg.norm(end - start) + width
    return box((width, width, length), (start + end) / 2, color, axes)


def tube(line: np.ndarray, radius: np.ndarray, color: tuple) -> Mesh:
    """A tube about the nodes `line` (N, 3) with a radius at each (N,)."""
    tangents = np.gradient(line, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normals = np.empty_like(line)
    normal = np.cross(tangents[0], [0.0, 1.0, 0.0])
    for i, tangent in enumerate(tangents):  # carried along without twist
        normal = normal - (normal @ tangent) * tangent
        normal /= np.linalg.norm(normal)
        normals[i] = normal
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    around = np.cos(angle)[:, None, None] * normals
    around = around + np.sin(angle)[:, None, None] * np.cross(tangents, normals)
    vertices = (line + radius[:, None] * around).reshape(-1, 3)  # (SIDES, N)
    side, node = np.meshgrid(np.arange(SIDES), np.arange(len(line) - 1), indexing="ij")
    here, there = side * len(line) + node, (side + 1) % SIDES * len(line) + node
    triangles = np.concatenate(
        [
            np.stack([here, there, here + 1], axis=-1).reshape(-1, 3),
            np.stack([there, there + 1, here + 1], axis=-1).reshape(-1, 3),
        ]
    )
    return Mesh(vertices, triangles, np.tile(color, (len(triangles), 1)))


def room(fork_width: float, fork_height: float, robot: Robot) -> Mesh:
    """All that stands still: tiled floor, wall, fork, and the robot's pedestal."""
    floor = -fork_height
    tiles = [
        box(
            (TILE, TILE, 0.02),
            np.array([TILE * i, TILE * j, floor - 0.01]),
            FLOOR_COLOR if (i + j) % 2 else TILE_COLOR,
        )
        for i in range(-4, 4)
        for j in range(-5, 7)
    ]
    wall = box((0.02, 12 * TILE, 2.4), np.array([-4 * TILE, 0.2, floor + 1.2]), WALL_COLOR)
    fork = []
    for side in (-1, 1):
        tip = np.array([side * fork_width / 2, 0.0, 0.0])
        post = tip + [side * (CLAMP + ROD) / 2, 0.0, 0.0]
        top = CLAMP / 2
        center = [post[0], 0.0, (floor + top) / 2]
        fork.append(box((ROD, ROD, top - floor), center, FORK_COLOR))
        fork.append(box((CLAMP, ROD, ROD), tip + [0.0, 0.0, ROD / 2], FORK_COLOR))
    foot = [0.0, 0.0, floor + ROD / 2]
    fork.append(box((fork_width + 0.2, 3 * ROD, ROD), foot, FORK_COLOR))
    base = robot.base_position
    pedestal = box(
        (0.4, 0.4, base[2] - floor), [base[0], base[1], (floor + base[2]) / 2], PEDESTAL_COLOR
    )
    return joined([*tiles, wall, *fork, pedestal])


def arm(robot: Robot, tip: np.ndarray, finger: float) -> Mesh:
    """The robot with its tool centre point at `tip` (3,) and each finger `finger` m from closed."""
    axes = robot.tool_axes  # columns: side, closing, approach
    approach = axes[:, 2]
    parts = [box((0.07, 0.2, 0.07), tip - 0.10 * approach, ROBOT_COLOR, axes)]
    for sign in (-1, 1):
        center = tip - 0.03 * approach + sign * (finger + 0.006) * axes[:, 1]
        parts.append(box((0.02, 0.012, 0.08), center, FINGER_COLOR, axes))
    wrist = tip - WRIST * approach
    parts.append(beam(tip - 0.13 * approach, wrist, 0.09, ROBOT_COLOR))
    shoulder = robot.base_position + [0.0, 0.0, SHOULDER]
    reach = wrist - shoulder
    distance = np.linalg.norm(reach)
    rise = np.sqrt(max(LINK**2 - (distance / 2) ** 2, 0.0))  # of an isosceles elbow, upwards
    upwards = np.cross([1.0, 0.0, 0.0], reach / distance)
    elbow = shoulder + reach / 2 + rise * upwards
    parts.append(beam(robot.base_position, shoulder, 0.15, ROBOT_COLOR))
    parts.append(beam(shoulder, elbow, 0.12, ROBOT_COLOR))
    parts.append(beam(elbow, wrist, 0.10, ROBOT_COLOR))
    return joined(parts)
