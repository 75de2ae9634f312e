"""The mass of the tool and the pose's delay against the force, by the tool's inertia.

In free motion the sensor feels its own tool's weight and inertia, which the pose tells but for the
tool's mass. The band's force is not used: that it leads the path is what damping does, and a delay
that was taken from it would take the damping away. What of its tool a sensor takes off by itself
does not show, and so is not taken off again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from sling2sim2real.recording.geometry import Geometry
from sling2sim2real.recording.grasp import MARGIN
from sling2sim2real.recording.motion import Motion, interpolated
from sling2sim2real.recording.pulls import Pull
from sling2sim2real.recording.release import SETTLE
from sling2sim2real.recording.tare import load_per_mass
from sling2sim2real.settings.lab import Tool

LONGEST = 0.1  # s of either sign
BLOCK = 0.2  # s in which errors of the smoothed force go together
LEAST_LOAD = 8.0  # standard deviations by which the tool's mass must show
WINDOW = 0.15  # s of the fits by which the load changes
STEP = 0.002  # s of the grid on which the load is tabulated
ROUNDS = 8


@dataclass(frozen=True)
class ToolInertia:
    """The tool that the force sensor carries, as its inertia shows it.

    Attributes:
        mass, mass_error: Of the tool, and its standard deviation [kg]; negative where the sensor
            has the other sign, or takes off more than there is.
        delay, delay_error: By which the pose's stamps are late, and its standard deviation [s].
        center: Of mass [m], as in setup.tool.
    """

    mass: float
    mass_error: float
    delay: float
    delay_error: float
    center: tuple[float, ...] = (0.0, 0.0, 0.0)

    def force(
        self, motion: Motion, geometry: Geometry, times: np.ndarray, release: float
    ) -> np.ndarray:
        """Part of the raw force at times (T,) [s] that is the tool's inertia, shape (T, 3) [N].

        Not the weight: a sensor may know that, and the hand does not turn. The hand may start back
        at `release` [s].
        """
        at, jump = times + self.delay, release + self.delay
        center = np.array(self.center)
        return self.mass * load_per_mass(
            motion, geometry, at, center, gravity=np.zeros(3), jump=jump
        )


def estimate_tool_inertia(pull: Pull, tool: Tool | None) -> ToolInertia | None:
    """None where the tool does not show: the sensor knows it already, or the hand hardly moves.

    Args:
        tool: setup.tool; only its centre of mass is used, the mass is fitted.
    """
    t, raw, motion = pull.force_time, pull.force, pull.motion
    grasp, release = pull.grasp, pull.release.time
    sure = MARGIN + WINDOW / 2
    inside = (t > max(t[0], motion.time[0]) + sure) & (t < min(t[-1], motion.time[-1]) - sure)
    free = np.flatnonzero(inside & ((t < grasp - sure) | (t > release + SETTLE + sure)))
    if len(free) * pull.recording.wrench.period < WINDOW:
        return None
    center = np.zeros(3) if tool is None else np.array(tool.center)
    grid = np.arange(motion.time[0], motion.time[-1], STEP)
    load = load_per_mass(motion, pull.geometry, grid, center)
    width = 2 * round(WINDOW / STEP / 2) + 1
    change = np.asarray(savgol_filter(load, width, 3, deriv=1, delta=STEP, axis=0))
    table = np.hstack([load, change])
    t, force, late = t[free], raw[free], t[free] > release

    blocks = np.unique((t / BLOCK).astype(int), return_inverse=True)[1]
    delay, mass, errors = 0.0, 0.0, np.full(2, np.inf)
    for _ in range(ROUNDS):  # Gauss-Newton
        at = t + delay  # stamps that are late say later what happens now
        seen = np.hstack([interpolated(at, grid, table), force])
        for part in (late, ~late):  # each has a bias of its own
            seen[part] -= seen[part].mean(axis=0) if part.any() else 0.0
        columns, right = seen[:, :6].reshape(-1, 2, 3), seen[:, 6:]
        normal = np.einsum("tic,tjc->ij", columns, columns)
        if np.linalg.cond(normal) > 1e10:
            return None  # the hand rests all the time
        inverse = np.linalg.inv(normal)
        mass, product = inverse @ np.einsum("tic,tc->i", columns, right)
        left = right - np.einsum("tic,i->tc", columns, [mass, product])
        errors = _noise(left, blocks, 2 + 3 * len(np.unique(late))) * np.sqrt(np.diag(inverse))
        delay = float(np.clip(delay + product / mass, -LONGEST, LONGEST))
    if abs(delay) >= LONGEST or abs(mass) < LEAST_LOAD * errors[0]:
        return None
    mass, delay_error = float(mass), float(errors[1] / abs(mass))
    return ToolInertia(mass, float(errors[0]), delay, delay_error, tuple(center.tolist()))


def _noise(left: np.ndarray, blocks: np.ndarray, fitted: int) -> float:
    """Standard deviation of residuals (T, 3), as if white: by samples or by means of blocks.

    The means tell errors that go together for longer; `fitted` parameters have made them smaller.
    """
    sizes = np.bincount(blocks)[:, None]
    means = np.stack([np.bincount(blocks, axis) for axis in left.T], axis=1) / sizes
    slow = np.sum(sizes * means**2) / max(means.size - fitted, 1)
    return float(np.sqrt(max(np.mean(left**2), slow)))
