"""How the arm follows its path: a mass on a spring and a damper, as an impedance controller has it.

    M (a - a_path) = F - K (x - x_path) - D (v - v_path)

so the hand gives a little under the band's force F and swings back when the band slips out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

from rig.physics.motion import HandMotion

if TYPE_CHECKING:
    from pipeline.params.virtual_rig import RigArm


@dataclass(frozen=True)
class Servo:
    """The arm as its hand shows it, alike in every direction, on its way along a path.

    Attributes:
        mass: That the hand seems to have [kg].
        stiffness: Of the controller [N/m].
        damping: Of the controller [N s/m].
        motion: The path.
    """

    mass: float
    stiffness: float
    damping: float
    motion: HandMotion

    @classmethod
    def of(cls, arm: RigArm, motion: HandMotion) -> Servo:
        damping = 2 * arm.damping_ratio * np.sqrt(arm.stiffness * arm.mass)
        return cls(arm.mass, arm.stiffness, float(damping), motion)

    def __call__(
        self, time: np.ndarray | float, x: np.ndarray, v: np.ndarray, force: np.ndarray
    ) -> np.ndarray:
        """Acceleration at `time` (T,) or one, of places, velocities and loads (3, ...)."""
        rest = (1,) * (x.ndim - 1 - np.ndim(time))

        def path(derivative: int) -> np.ndarray:
            along = np.moveaxis(self.motion.position(time, derivative), -1, 0)
            return along.reshape(*along.shape, *rest)

        astray = self.stiffness * (x - path(0)) + self.damping * (v - path(1))
        return path(2) + (force - astray) / self.mass

    def alone(self, state: np.ndarray, times: np.ndarray, tolerance: float) -> np.ndarray:
        """Place and velocity (T, 6) at `times` of the free hand that starts with `state` (6,)."""

        def rates(time: float, y: np.ndarray) -> np.ndarray:
            return np.concatenate([y[3:], self(time, y[:3], y[3:], np.zeros(3))])

        span = (times[0], times[-1])
        return solve_ivp(rates, span, state, t_eval=times, rtol=tolerance, atol=1e-9).y.T
