"""What is simulated: a band clamped at the fork's tips, and the five parameters of its material."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.base.errors import UserError
from pipeline.sling import tetrahedra

GRAVITY = 9.81
ROD, TETRAHEDRA = "rod", "tetrahedra"  # meshes: rod.h, tetrahedra.h
THETA = (
    "youngs_modulus",
    "poissons_ratio",
    "elasticity_damping",
    "dynamic_friction",
    "damping_scale",
)


@dataclass(frozen=True)
class Sling:
    """Geometry and mass of a clamped band, and the resolution it is simulated with.

    Attributes:
        edges: Even number of edges along the band; the hand holds the layer in the middle.
        rest_length, radius, mass: Of the band between the clamps [m, m, kg].
        half_width: Half the distance of the fork's tips [m].
        fork_height: Of the tips above the floor [m].
        clamp_direction: Unit vector along which the band leaves the tip at -x, shape (3,); it
            leaves the other tip along the mirror image.
        flexural_rigidity: E I of the band where it was measured [N m^2], one or one a theta; None
            takes a solid round band's, which follows Young's modulus. Tetrahedra are solid and
            round: they bend as their mesh does, whatever was measured.
        projectile_mass, grip_force, finger_opening_time: As in params.yaml `setup` [kg, N, s].
        steps: The step sizes and the mesh's grading, as in params.yaml `sling`.
        clamped: Whether the first and the last end are held; experiments on a free band let go.
        clamp_twist: Of the last clamp about the band, against the first [rad].
        air_drag: Of the moving band: force for its mass and speed [1/s], one or one a theta. It is
            the drag of a cylinder across the wind, linear about the speeds of a recoil.
        mesh: ROD, or TETRAHEDRA: a solid cylinder, whose edges are equally long. What of the band
            is inside the clamps does not deform there, so that the mesh ends at them.
    """

    edges: int
    rest_length: float
    radius: float
    mass: float
    half_width: float
    fork_height: float
    clamp_direction: np.ndarray
    flexural_rigidity: float | None
    projectile_mass: float
    grip_force: float
    finger_opening_time: float
    steps: object
    clamped: tuple[bool, bool] = (True, True)
    clamp_twist: float = 0.0
    mesh: str = ROD
    air_drag: float | np.ndarray = 0.0

    @classmethod
    def of(
        cls, band, setup, resolution, mounting: dict | None = None, *, as_rod: bool = False
    ) -> Sling:
        """Make it from params.yaml's `bands.<band>`, `setup` and `sling`.

        Args:
            mounting: What the slack band shows of itself (pipeline/objective/clamps.py):
                `clamp_direction` and `flexural_rigidity`; without it, the setup's clamp direction
                and a solid round band.
            as_rod: Whatever mesh the resolution asks for.
        """
        mounting = mounting or {}
        mesh, edges = ROD, resolution.edges
        if not as_rod:
            mesh = resolution.mesh
            edges = {ROD: edges, TETRAHEDRA: resolution.tet_edges}[mesh]
        direction = np.asarray(mounting.get("clamp_direction", setup.clamp_direction), float)
        return cls(
            edges=edges,
            rest_length=band.rest_length,
            radius=band.diameter / 2,
            mass=band.mass,
            half_width=setup.fork_width / 2,
            fork_height=setup.fork_height,
            clamp_direction=direction / np.linalg.norm(direction),
            flexural_rigidity=mounting.get("flexural_rigidity"),
            projectile_mass=setup.projectile_mass,
            grip_force=setup.grip_force,
            finger_opening_time=setup.finger_opening_time,
            steps=resolution,
            mesh=mesh,
        )

    @property
    def layers(self) -> int:
        return self.edges + 1

    @property
    def middle(self) -> int:
        return self.edges // 2

    @property
    def unknowns(self) -> int:
        """Of a layer: a node and two directors, or the places of a section's vertices."""
        return 9 if self.mesh == ROD else tetrahedra.UNKNOWNS

    @property
    def edge_lengths(self) -> np.ndarray:
        """Rest length of each edge [m], shape (edges,).

        A taut band turns within sqrt(E I / tension), a few millimetres, at the clamps and in the
        hand: there the rod's edges are `grading` times shorter than midway between them.
        """
        if self.mesh == TETRAHEDRA:
            return np.full(self.edges, self.rest_length / self.edges)
        place = (np.arange(self.middle) + 0.5) / self.middle
        half = 1 + (self.steps.grading - 1) * np.sin(np.pi * place) ** 2
        sizes = np.concatenate([half, half])
        return self.rest_length * sizes / sizes.sum()

    @property
    def arc(self) -> np.ndarray:
        """Rest length from the first clamp to each node [m], shape (layers,)."""
        return np.concatenate([[0.0], np.cumsum(self.edge_lengths)])

    @property
    def area(self) -> float:
        return np.pi * self.radius**2

    @property
    def tips(self) -> np.ndarray:
        """Both ends of the band, shape (2, 3)."""
        return np.array([[-self.half_width, 0.0, 0.0], [self.half_width, 0.0, 0.0]])


def mounting_path(band: str, root: str | Path = ".") -> Path:
    return Path(root, "data", "mounting", f"{band}.json")


def load_sling(params, band: str, root: str | Path = ".") -> Sling:
    """The sling of a band of params.yaml, mounted as its recording shows where that was fitted."""
    path = mounting_path(band, root)
    mounting = None
    if path.exists():
        try:
            mounting = json.loads(path.read_text(encoding="utf-8"))
            mounting["clamp_direction"], mounting["flexural_rigidity"]
        except (ValueError, KeyError, TypeError) as error:
            raise UserError(
                f"{path}: damaged; `dvc repro --force mounting@{band}` makes it anew"
            ) from error
    else:
        print(
            f"note: {path} is missing, so the band hangs as `setup` says; `dvc repro"
            f" mounting@{band}` fits it to a recording",
            file=sys.stderr,
        )
    return Sling.of(params.bands[band], params.setup, params.sling, mounting)


def material(sling: Sling, thetas: np.ndarray) -> np.ndarray:
    """What state.h takes for physical thetas (N, 5): mu, lam, d, s, 2 friction, cb, drag; (N, 7).

    mu is the shear modulus and lam the volume modulus of the stable neo-Hookean law without its
    logarithm (Smith, de Goes, Kim 2018): first Lame parameter plus mu, so that E and nu are the
    small-strain ones.
    """
    young, poisson, damping, friction, scale = np.asarray(thetas, float).T
    mu = young / (2 * (1 + poisson))
    lam = young * poisson / ((1 + poisson) * (1 - 2 * poisson)) + mu
    if sling.flexural_rigidity is None:
        bending = (1 + poisson) * sling.radius**2 / 2
    else:
        bending = sling.flexural_rigidity / (mu * sling.area)
    drag = np.broadcast_to(sling.air_drag, young.shape)
    return np.stack([mu, lam, damping, scale, 2 * friction, bending, drag], axis=1)


def _transport(normal: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Carry `normal` (3,) along the smallest rotations from unit `start` (3,) to `end` (..., 3)."""
    axis = np.cross(start, end)
    cosine = (end @ start)[..., None]
    turned = np.cross(axis, normal)
    return normal + turned + np.cross(axis, turned) / np.maximum(1 + cosine, 1e-6)


def clamp_tangents(sling: Sling) -> np.ndarray:
    """Unit tangents of the band in the first and the last clamp, shape (2, 3)."""
    first = sling.clamp_direction
    return np.array([first, [first[0], -first[1], -first[2]]])


def fixed_frames(sling: Sling) -> np.ndarray:
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


def _directors(sling: Sling, end: int, direction: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Directors (..., 6) of edges along unit `direction` (..., 3), turned from a clamp's frame.

    A stretched edge thins, its volume the same.
    """
    turned = _transport(fixed_frames(sling)[end, 0], clamp_tangents(sling)[end], direction)
    both = np.concatenate([turned, np.cross(direction, turned)], axis=-1)
    return both * stretch[..., None] ** -0.5


def layers_of(sling: Sling, nodes: np.ndarray) -> np.ndarray:
    """Unknowns (..., L, unknowns) of bands through `nodes` (..., L, 3)."""
    state = np.zeros((*nodes.shape[:-1], 9))
    state[..., :3] = nodes
    edges = np.diff(nodes, axis=-2)
    length = np.linalg.norm(edges, axis=-1)
    direction, stretch = edges / length[..., None], length / sling.edge_lengths
    for end, half in enumerate((slice(0, sling.middle), slice(sling.middle, sling.edges))):
        state[..., half, 3:] = _directors(sling, end, direction[..., half, :], stretch[..., half])
    state[..., -1, 3:] = fixed_frames(sling)[1].ravel()
    return _meshed(sling, state)


def _meshed(sling: Sling, rod: np.ndarray) -> np.ndarray:
    """Unknowns of the sling's mesh for a rod's (..., L, 9): sections lie between their edges."""
    if sling.mesh == ROD:
        return rod
    frames = fixed_frames(sling)[:2].reshape(2, 6)
    after = rod[..., 3:]
    directors = (after + np.roll(after, 1, axis=-2)) / 2
    directors[..., [0, -1], :] = frames
    return tetrahedra.layers(rod[..., :3], directors, sling.radius)


def hanging_guess(sling: Sling) -> np.ndarray:
    """A U below the tips: two legs and a half circle, shape (layers, unknowns)."""
    half, length = sling.half_width, sling.rest_length
    leg = max((length - np.pi * half) / 2, 0.0)
    arc = sling.arc
    nodes = np.zeros((sling.layers, 3))
    angle = np.clip((arc - leg) / (length - 2 * leg), 0, 1) * np.pi
    nodes[:, 0] = -half * np.cos(angle)
    nodes[:, 2] = -np.minimum(np.minimum(arc, length - arc), leg)
    nodes[:, 2] -= half * np.sin(angle)
    return layers_of(sling, nodes)


def drawn_guess(sling: Sling, draws: np.ndarray) -> np.ndarray:
    """Two straight halves from the tips to each draw (N, 2), shape (N, layers, unknowns)."""
    middle = np.column_stack([np.zeros(len(draws)), draws])
    part = (sling.arc / sling.arc[sling.middle])[: sling.middle + 1, None]
    state = np.zeros((len(draws), sling.layers, 9), np.float32)
    halves = slice(0, sling.middle + 1), slice(sling.middle, None)
    for end, (half, tip) in enumerate(zip(halves, sling.tips, strict=True)):
        span = middle - tip
        state[:, half, :3] = tip + (part if end == 0 else part[::-1]) * span[:, None]
        length = np.linalg.norm(span, axis=1)
        direction = span / (length if end == 0 else -length)[:, None]
        stretch = length / (sling.rest_length / 2)
        state[:, half, 3:] = _directors(sling, end, direction, stretch)[:, None]
    state[:, -1, 3:] = fixed_frames(sling)[1].ravel()
    return _meshed(sling, state)
