"""A band as a chain of point masses between springs: what an engine without our law can hold.

Equal masses are joined by massless springs that pull and never push. At a strain e = length / rest
length - 1 > 0, with l = 1 + e,

    pull = K/3 (l - l^-2) (1 - m + m/l + c (l^2 + 2/l - 3)) + K tau e'

and the second term alone where e <= 0: a string of Biderman's rubber. The clamps are points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import UserError
from sling2sim2real.simulator.initial import hanging_line
from sling2sim2real.simulator.model import GRAVITY
from sling2sim2real.simulator.rubber import uniaxial

CHAIN_EDGES = 20
TIME_STEPS_S = (5e-4, 2.5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # s, of time
# Of 2: h^2 w^2 / 2 + h g of the fastest mode, where explicit steps begin to grow.
STABILITY_LIMIT = 1.2
MATCHED = {"strength": "N", "mooney_share": "", "damping_time": "s"}  # what a match finds; units
KNEE_OF_STRAIN = 0.25  # of the largest strain: from there on a second spring helps the first


@dataclass(frozen=True)
class Shot:
    """A launch, frame O, SI units; NaN where nothing left the pouch."""

    landing: float
    speed: float
    angle: float
    hold_force: float


@dataclass(frozen=True)
class SpringChain:
    """Geometry, masses and springs, SI units, frame O.

    Attributes:
        edges: Springs, an even number; the hand holds the node in the middle.
        rest_length, mass: Of the whole band [m, kg].
        half_width: Half the distance of the clamps [m].
        floor: Its height, z [m].
        projectile_mass: [kg].
        arm_stiffness: Of the hand's drive [N/m]; None: it does not give way.
        strength, mooney_share, upturn, damping_time: K [N], m, c, tau [s].
        largest_strain: Up to which the springs are matched.
        step: Of time [s].
    """

    edges: int
    rest_length: float
    mass: float
    half_width: float
    floor: float
    projectile_mass: float
    arm_stiffness: float | None
    strength: float
    mooney_share: float
    upturn: float
    damping_time: float
    largest_strain: float
    step: float

    @classmethod
    def of(cls, model: Model, draws: np.ndarray, hold_force: np.ndarray) -> SpringChain:
        """A first guess: straight halves that pull with `hold_force` (N,) at draws (N, 2).

        Its damping time is θ's, its time step the largest that is stable with that.
        """
        setup, band, theta = model.settings.setup, model.band, model.parameters.sample()
        tension, stretch = cls.tension(model, draws, hold_force)
        share, upturn = theta.get("mooney_share", 0.0), theta.get("upturn", 0.0)
        chain = cls(
            edges=CHAIN_EDGES,
            rest_length=band.rest_length,
            mass=band.mass,
            half_width=setup.fork_width / 2,
            floor=-setup.fork_height,
            projectile_mass=setup.projectile_mass,
            arm_stiffness=setup.arm_stiffness,
            strength=float(np.mean(3 * tension / uniaxial(stretch, share, upturn))),
            mooney_share=share,
            upturn=upturn,
            damping_time=theta["elasticity_damping"],
            largest_strain=float(stretch.max() - 1),
            step=TIME_STEPS_S[-1],
        )
        return replace(chain, step=chain.stable_step)

    @staticmethod
    def tension(model: Model, draws: np.ndarray, hold_force: np.ndarray) -> np.ndarray:
        """Pull [N] and stretch, shape (2, N), of straight halves that the hand holds at draws."""
        setup, band = model.settings.setup, model.band
        distance = np.linalg.norm(draws, axis=1)
        half = np.hypot(setup.fork_width / 2, distance)
        weight = (setup.projectile_mass + band.mass / 2) * GRAVITY
        pull = (hold_force - weight * draws[:, 1] / distance) * half / (2 * distance)
        return np.stack([pull, 2 * half / band.rest_length])

    @property
    def matched(self) -> dict[str, float]:
        """What a match finds."""
        return {name: getattr(self, name) for name in MATCHED}

    @property
    def spring_length(self) -> float:
        """[m]."""
        return self.rest_length / self.edges

    @property
    def node_mass(self) -> float:
        """[kg]; half of one lies at each clamp."""
        return self.mass / self.edges

    @property
    def tips(self) -> np.ndarray:
        """The clamps, shape (2, 3)."""
        return np.array([[-self.half_width, 0.0, 0.0], [self.half_width, 0.0, 0.0]])

    @property
    def damping(self) -> float:
        """Damping of a spring [N s/m]."""
        return self.strength * self.damping_time / self.spring_length

    def pull(self, strain: np.ndarray | float) -> np.ndarray:
        """Pull of a spring at rest [N], like `strain`."""
        stretch = 1 + np.maximum(strain, 0.0)
        return self.strength / 3 * uniaxial(stretch, self.mooney_share, self.upturn)

    @property
    def stable_step(self) -> float:
        """The largest of TIME_STEPS_S with which explicit steps are stable. Raises UserError."""
        fastest = self._fastest
        for step in TIME_STEPS_S:
            if step * fastest * (step / 2 + self.damping_time) <= STABILITY_LIMIT:
                return step
        raise UserError(f"a chain of this band needs time steps below {TIME_STEPS_S[-1]:g} s")

    @property
    def most_damping(self) -> float:
        """Damping time with which its time step is just stable [s]."""
        return 1.5 * STABILITY_LIMIT / (self.step * self._fastest) - self.step / 2

    @property
    def _fastest(self) -> float:
        """Square of the fastest mode's rate [1/s^2]: neighbours that go against each other."""
        strain = np.linspace(0, self.largest_strain, 101)
        steepest = max(self.strength, float(np.gradient(self.pull(strain), strain).max()))
        return 4 * steepest / self.spring_length / self.node_mass

    def cubic_springs(self) -> tuple[np.ndarray, np.ndarray, float, float]:
        """The pull as that of two springs of cubic pull, the second beyond a knee.

        Returns:
            Coefficients of lengthening, its square and cube [N/m, N/m^2, N/m^3] of the first (3,)
            and the second (3,), strain of the knee, largest relative error of their pull.
        """
        knee, rest = KNEE_OF_STRAIN * self.largest_strain, self.spring_length
        strain = np.linspace(0, self.largest_strain, 201)[1:]
        beyond = np.maximum(strain - knee, 0)
        powers = np.stack([strain, strain**2, strain**3, beyond**2, beyond**3], axis=1)
        pull = self.pull(strain)
        weights = 1 / np.maximum(pull, self.pull(KNEE_OF_STRAIN * knee))[:, None]
        factors = np.linalg.lstsq(weights * powers, weights[:, 0] * pull, rcond=None)[0]
        error = np.abs(weights[:, 0] * (powers @ factors - pull)).max()
        first, second = factors[:3], np.array([0.0, *factors[3:]])
        scale = rest ** np.arange(1, 4)
        return first / scale, second / scale, knee, float(error)

    def hanging(self) -> np.ndarray:
        """Two legs and a half circle below the clamps, without stretch, shape (edges + 1, 3)."""
        arc = np.linspace(0, self.rest_length, self.edges + 1)
        return hanging_line(self.half_width, self.rest_length, arc)[0]

    def drawn(self, place: np.ndarray) -> np.ndarray:
        """Two straight halves from the clamps to a place (3,), shape (edges + 1, 3)."""
        part = np.linspace(0, 1, self.edges // 2 + 1)[:, None]
        first, last = (tip + part * (place - tip) for tip in self.tips)
        return np.concatenate([first, last[-2::-1]])
