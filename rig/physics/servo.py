"""How the arm follows its path: a mass on a spring and a damper, as an impedance controller has it.

    M (a - a_path) = F - K (x - x_path) - D (v - v_path)

so the hand gives a little under the band's force F and swings back when the band slips out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.physics.compiled import compiled
from rig.physics.integration import integrated
from rig.physics.motion import Path, place

if TYPE_CHECKING:
    from pipeline.params.virtual_rig import RigArm


class Servo(NamedTuple):
    """The arm as its hand shows it, alike in every direction, on its way along a path.

    Attributes:
        mass: That the hand seems to have [kg]; infinite: it moves as its path, whatever pulls.
        stiffness: Of the controller [N/m].
        damping: Of the controller [N s/m].
        path: Where it is sent.
    """

    mass: float
    stiffness: float
    damping: float
    path: Path

    @classmethod
    def of(cls, arm: RigArm, path: Path) -> Servo:
        damping = 2 * arm.damping_ratio * np.sqrt(arm.stiffness * arm.mass)
        return cls(arm.mass, arm.stiffness, float(damping), path)

    def acceleration(self, times: np.ndarray, states: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Hand's acceleration at place and velocity (6,) under the band's force (3,) [m/s2]."""
        rows = zip(times, states, force, strict=True)
        return np.array([acceleration(time, state, load, self) for time, state, load in rows])

    def alone(self, state: np.ndarray, times: np.ndarray, tolerance: float) -> np.ndarray:
        """Place and velocity (T, 6) at `times` of the free hand that starts with `state` (6,)."""
        return integrated(_rates, state, times, self, tolerance, 1e-9)[1]


@compiled
def acceleration(time: float, state: np.ndarray, force: np.ndarray, servo: Servo) -> np.ndarray:
    """Acceleration (T, 3) at T times, by place and velocity (T, 6) and the band's force (T, 3)."""
    path = place(time, servo.path)
    astray = servo.stiffness * (state[:3] - path[0]) + servo.damping * (state[3:6] - path[1])
    return path[2] + (force - astray) / servo.mass


@compiled
def _rates(time: float, state: np.ndarray, out: np.ndarray, servo: Servo) -> None:
    out[:3], out[3:] = state[3:], acceleration(time, state, np.zeros(3), servo)


_NOWHERE = Path(np.array([0.0, 1.0]), *np.zeros((2, 2, 3))[:1], *np.zeros((3, 0, 3)))
STILL = Servo(np.inf, 0.0, 0.0, _NOWHERE)  # it does not move
ABSENT = Servo(0.0, 0.0, 0.0, _NOWHERE)  # there is no hand
