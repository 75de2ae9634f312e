"""What is simulated: a band clamped at the fork's tips, its resolution, and how it is launched."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sling2sim2real.settings.identification import SlingParams
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.simulator.rubber import NEO_HOOKEAN

GRAVITY = 9.81
FARTHEST_DRAW_M = 1.0  # m, farther than a band is drawn
CYLINDER_DRAG = 1.1  # across the wind, at Reynolds numbers of 1e3 to 1e4 (Wieselsberger 1921)
DOFS = 9  # of a cross-section: a node and two directors


class BandSizes(Protocol):
    """What a scale and a ruler say of a band: mass between the clamps, diameter, length [kg, m].

    `preconditioned`: its largest draw before it was recorded [m], or True for farther than any.
    """

    @property
    def mass(self) -> float: ...
    @property
    def diameter(self) -> float: ...
    @property
    def rest_length(self) -> float: ...
    @property
    def preconditioned(self) -> float | bool: ...


def first_draw(band: BandSizes) -> float:
    """Largest draw of a band before it was recorded [m], 0 of a new one."""
    before = band.preconditioned
    return FARTHEST_DRAW_M * before if isinstance(before, bool) else before


class ClampValues(Protocol):
    """How a band leaves its clamps, a unit vector, and its flexural rigidity [N m^2]."""

    clamp_direction: tuple[float, float, float]
    flexural_rigidity: float


@dataclass(frozen=True)
class LaunchHistory:
    """How a hand draws the band for a launch: straight from the fork, at rest at both ends.

    Attributes:
        pull_time: That the way takes, a cubic in time [s].
        pause: From there to the release [s].
        deepest: Largest draw that the band has seen before, which softened it [m]; one, or one of
            each launch, shape (N,).
    """

    pull_time: float
    pause: float
    deepest: float | np.ndarray = 0.0


@dataclass(frozen=True)
class LaunchSetup:
    """What a launch has that a recorded pull has not: projectile, arm, floor, and its steps.

    Attributes:
        projectile_mass: In the pouch [kg]; one, or one of each launch, shape (N,).
        fork_height: Of the tips above the floor [m].
        foot_height: Of what joins the fork's rods on the floor, which a projectile may hit [m].
        arm_stiffness: Of the arm that holds a band to launch it [N/m], which is sent to the draw
            and rests where its spring holds the band; None: it does not give way.
        step, duration: Length of a step, and of the simulation from the release on [s].
        history: Of a law with memory: how the band was drawn; None: it has forgotten all.
    """

    projectile_mass: float | np.ndarray
    fork_height: float
    foot_height: float
    arm_stiffness: float | None
    step: float
    duration: float
    history: LaunchHistory | None = None

    @classmethod
    def of(
        cls, setup: SetupParams, resolution: SlingParams, history: LaunchHistory | None = None
    ) -> LaunchSetup:
        """Make it from params.yaml's `setup` and `sling`."""
        return cls(
            projectile_mass=setup.projectile_mass,
            fork_height=setup.fork_height,
            foot_height=setup.foot_height,
            arm_stiffness=setup.arm_stiffness,
            step=resolution.launch_step,
            duration=resolution.launch_time,
            history=history,
        )


@dataclass(frozen=True)
class ClampedBand:
    """Geometry and mass of a clamped band, and the resolution it is simulated with.

    Attributes:
        edges: Even number of edges along the band; the hand holds the cross-section in the middle.
        rest_length, radius, mass: Of the band between the clamps [m, m, kg].
        half_width: Half the distance of the fork's tips [m].
        clamp_direction: Unit vector along which the band leaves the tip at -x, shape (3,); it
            leaves the other tip along the mirror image.
        flexural_rigidity: E I of the band where it was measured [N m^2]; None takes a solid round
            band's, which follows Young's modulus.
        grip_force, finger_opening_time: Of the fingers that hold the middle of a recorded band, as
            in params.yaml `setup` [N, s].
        steps: The step sizes and the mesh's grading, as in params.yaml `sling`.
        clamped: Whether the first and the last end are held; experiments on a free band let go.
        clamp_twist: Of the last clamp about the band, against the first [rad].
        air_density: For the drag of a cylinder across the wind [kg/m^3].
        law: NEO_HOOKEAN, RUBBER (rubber.h) or COROTATED (corotated.h).
        stretched: Largest stretch that the band has seen before, which softened it; one, or one of
            each in a batch, shape (N,).
    """

    edges: int
    rest_length: float
    radius: float
    mass: float
    half_width: float
    clamp_direction: np.ndarray
    flexural_rigidity: float | None
    grip_force: float
    finger_opening_time: float
    steps: SlingParams
    clamped: tuple[bool, bool] = (True, True)
    clamp_twist: float = 0.0
    air_density: float = 0.0
    law: str = NEO_HOOKEAN
    stretched: float | np.ndarray = 1.0

    @classmethod
    def of(
        cls,
        band: BandSizes,
        setup: SetupParams,
        resolution: SlingParams,
        mounting: ClampValues | None = None,
        *,
        law: str = NEO_HOOKEAN,
    ) -> ClampedBand:
        """Make it from params.yaml's `bands.<band>`, `setup` and `sling`.

        Args:
            mounting: What the slack band shows of itself (identification/clamps.py); without it,
                the setup's clamp direction and a solid round band.
            law: Of its material.
        """
        direction = np.asarray((mounting or setup).clamp_direction, float)
        made = cls(
            edges=resolution.edges,
            rest_length=band.rest_length,
            radius=band.diameter / 2,
            mass=band.mass,
            half_width=setup.fork_width / 2,
            clamp_direction=direction / np.linalg.norm(direction),
            flexural_rigidity=None if mounting is None else mounting.flexural_rigidity,
            grip_force=setup.grip_force,
            finger_opening_time=setup.finger_opening_time,
            air_density=setup.air_density,
            steps=resolution,
            law=law,
        )
        return replace(made, stretched=float(made.drawn(np.array(first_draw(band)))))

    def drawn(self, distance: np.ndarray) -> np.ndarray:
        """Stretch (...) of straight halves that are drawn so far from the fork [m], 1 if slack."""
        return np.maximum(2 * np.hypot(self.half_width, distance) / self.rest_length, 1.0)

    @property
    def sections(self) -> int:
        return self.edges + 1

    @property
    def middle(self) -> int:
        return self.edges // 2

    @property
    def edge_lengths(self) -> np.ndarray:
        """Rest length of each edge [m], shape (edges,).

        A taut band turns within sqrt(E I / tension), a few millimetres, at the clamps and in the
        hand: there the edges are `grading` times shorter than midway between them.
        """
        place = (np.arange(self.middle) + 0.5) / self.middle
        half = 1 + (self.steps.grading - 1) * np.sin(np.pi * place) ** 2
        sizes = np.concatenate([half, half])
        return self.rest_length * sizes / sizes.sum()

    @property
    def arc(self) -> np.ndarray:
        """Rest length from the first clamp to each node [m], shape (sections,)."""
        return np.concatenate([[0.0], np.cumsum(self.edge_lengths)])

    @property
    def area(self) -> float:
        return np.pi * self.radius**2

    @property
    def tips(self) -> np.ndarray:
        """The two ends of the band, shape (2, 3)."""
        return np.array([[-self.half_width, 0.0, 0.0], [self.half_width, 0.0, 0.0]])
