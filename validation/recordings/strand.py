"""An elastic strand between two tips and a hand: the truth that pictures are made of.

Point masses joined by springs, with a little stiffness in bending, damping and drag, under gravity:
it hangs, is lifted, drawn taut, let go, and swings slack.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from validation.recordings.bag import REST, TIPS

NODES = 61
MIDDLE = NODES // 2
MASS, STIFFNESS, BENDING = 0.025, 18.0, 6e-5  # kg, N (force at twice the length), N m^2
DAMPING, DRAG = 3e-4, 1.5  # s of the springs' force, 1/s
STEP = 1e-4  # s
GRASP, LIFTED, DRAWN, RELEASE, END = 0.7, 1.3, 2.5, 2.9, 4.2
DRAW = 0.38


@dataclass(frozen=True)
class Strand:
    """What truly happens; times in seconds.

    Attributes:
        times: Shape (K,).
        lines: Centre lines, shape (K, NODES, 3).
    """

    times: np.ndarray
    lines: np.ndarray

    def center_line(self, time: float) -> np.ndarray:
        """Shape (NODES, 3)."""
        k = int(np.clip(np.searchsorted(self.times, time), 1, len(self.times) - 1))
        share = np.clip((time - self.times[k - 1]) / (self.times[k] - self.times[k - 1]), 0, 1)
        return (1 - share) * self.lines[k - 1] + share * self.lines[k]


@lru_cache(maxsize=1)
def path() -> PchipInterpolator:
    """The hand's way: to the hanging band's middle, up to the tips, back, and a little aside."""
    low = hanging()[MIDDLE]
    high, back = np.array([0.0, -0.02, 0.0]), np.array([0.0, -DRAW, 0.0])
    marks = (0.0, GRASP - 0.15, GRASP + 0.1, LIFTED, DRAWN, RELEASE, RELEASE + 0.3, END)
    away = low + [0, -0.1, 0.02]
    places = (away, low, low, high, back, back, back + [0, -0.05, 0.01], back + [0, -0.06, 0.01])
    return PchipInterpolator(marks, np.array(places))


def opening(time: float) -> float:
    """Between the fingers [m]."""
    return float(np.interp(time, [GRASP - 0.1, GRASP, RELEASE, RELEASE + 0.05], [7, 1, 1, 7])) / 100


@lru_cache(maxsize=1)
def hanging() -> np.ndarray:
    x = np.linspace(-1, 1, NODES)[:, None]
    line = x * TIPS[1] - 0.2 * (1 - x**2) * [0, 0, 1]
    speed = np.zeros_like(line)
    for _ in range(20_000):
        speed, line = _step(line, speed * 0.999, None)
    return line


@lru_cache(maxsize=1)
def strand() -> Strand:
    """The whole interaction, kept every millisecond."""
    line, hand = hanging().copy(), path()
    speed, times, lines = np.zeros_like(line), [], []
    count = round(END / STEP)
    places = hand(np.arange(count) * STEP)
    for k in range(count):
        time = k * STEP
        if k % 10 == 0:
            times.append(time), lines.append(line)
        held = places[k] if GRASP <= time < RELEASE else None
        speed, line = _step(line, speed, held)
    return Strand(np.array(times), np.array(lines))


def _step(line: np.ndarray, speed: np.ndarray, held: np.ndarray | None):
    """Symplectic Euler."""
    rest, mass = REST / (NODES - 1), MASS / (NODES - 1)
    ways, moves = np.diff(line, axis=0), np.diff(speed, axis=0)
    lengths = np.sqrt(np.einsum("ij,ij->i", ways, ways))
    along = ways / lengths[:, None]
    rate = np.einsum("ij,ij->i", moves, along)
    tension = STIFFNESS * ((lengths - rest) + DAMPING * rate) / rest
    pull = tension[:, None] * along
    bend = np.zeros_like(line)
    bow = line[:-2] - 2 * line[1:-1] + line[2:]
    bend[:-2] -= bow
    bend[1:-1] += 2 * bow
    bend[2:] -= bow
    force = BENDING / rest**3 * bend - DRAG * mass * speed
    force[:-1] += pull
    force[1:] -= pull
    speed = speed + STEP * (force / mass + [0, 0, -9.81])
    line = line + STEP * speed
    line[0], line[-1] = TIPS
    speed[0] = speed[-1] = 0
    if held is not None:
        line[MIDDLE], speed[MIDDLE] = held, 0.0
    return speed, line
