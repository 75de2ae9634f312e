"""Ropes that two robots swing, by the rod in plain NumPy (validation/simulator/reference.py).

A rope is a rod whose ends are led: at each end the two outer markers, which a gripper holds. Where
the ends are given, mass drops out: what counts is the bending stiffness over the mass of a length
and gravity, of which the cube root is the bending length (Peirce 1930), the damping time of bending
and the drag over mass and speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from pipeline.params.identification import SlingParams
from pipeline.simulator.model import GRAVITY, ClampedBand
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.records import Grip
from pipeline.simulator.rubber import NEO_HOOKEAN
from pipeline.simulator.schedule import steps
from validation.simulator.march import Driven, march
from validation.simulator.reference import ReferenceRod

RATE = 100.0  # of the frames [1/s]
LED = 0, 1, -2, -1  # markers
RADIUS, LINE_MASS = 4e-3, 0.05  # any: m, kg/m
YOUNG, POISSON = 4e6, 0.45  # so stiff that the rope's weight stretches it by less than 0.3 %
LONG = 0.95  # quantile of a chord between markers that is taken for the length of the rope there
SMOOTH = 7, 3  # frames and order of the polynomial that smooths what leads the ends
EXACT = 1e-8  # of the reference's steps [m]
NAMES = "bending_length", "damping", "drag"
START = {"bending_length": 0.2, "damping": 0.05, "drag": 0.3}  # m, s, 1/s
REACH = {"bending_length": (0.01, 0.6), "damping": (1e-4, 2.0), "drag": (1e-3, 10.0)}


@dataclass(frozen=True)
class Rope(ClampedBand):
    """A rod with edges of any length, its ends free to turn."""

    lengths: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def edge_lengths(self) -> np.ndarray:
        return self.lengths


def rope_of(chords: np.ndarray, parts: int, bending_length: float, setup: SlingParams) -> Rope:
    """A rope of `parts` edges in each length between markers, shape (M - 1,) [m]."""
    lengths = np.repeat(chords / parts, parts)
    return Rope(
        edges=len(lengths),
        rest_length=float(lengths.sum()),
        radius=RADIUS,
        mass=LINE_MASS * float(lengths.sum()),
        half_width=0.0,
        clamp_direction=np.array([1.0, 0.0, 0.0]),
        flexural_rigidity=bending_length**3 * LINE_MASS * GRAVITY,
        grip_force=0.0,
        finger_opening_time=0.0,
        steps=setup,
        clamped=(False, False),
        lengths=lengths,
    )


def chords_of(runs: Sequence[np.ndarray]) -> np.ndarray:
    """Lengths of the rope between markers [m], of runs (T, M, 3)."""
    every = np.concatenate([np.linalg.norm(np.diff(run, axis=1), axis=2) for run in runs])
    return np.quantile(every, LONG, axis=0)


def begun(run: np.ndarray, chords: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Sections and their rates (L, 9) of a run's first frame, untwisted."""
    place = np.append(0.0, np.cumsum(chords))
    nodes = np.interp(np.arange((len(place) - 1) * parts + 1) / parts, np.arange(len(place)), place)
    early = savgol_filter(run[: 2 * SMOOTH[0] + 1], *SMOOTH, axis=0)
    slope = savgol_filter(
        run[: 2 * SMOOTH[0] + 1], *SMOOTH, deriv=1, delta=1 / RATE, axis=0, mode="interp"
    )
    state, rates = np.zeros((len(nodes), 9)), np.zeros((len(nodes), 9))
    state[:, :3] = CubicSpline(place, early[0])(nodes)
    rates[:, :3] = CubicSpline(place, slope[0])(nodes)
    edges, turning = np.diff(state[:, :3], axis=0), np.diff(rates[:, :3], axis=0)
    size = np.linalg.norm(edges, axis=1, keepdims=True)
    tangents = edges / size
    spins = np.cross(tangents, turning / size)  # of the edges, without one about themselves
    a = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    a /= np.linalg.norm(a)
    for i, (tangent, spin) in enumerate(zip(tangents, spins, strict=True)):
        a = a - (a @ tangent) * tangent
        a /= np.linalg.norm(a)
        b = np.cross(tangent, a)
        state[i, 3:] = *a, *b
        rates[i, 3:] = *np.cross(spin, a), *np.cross(spin, b)
    state[-1, 3:] = state[-2, 3:]
    return state, rates


def swing(
    run: np.ndarray, chords: np.ndarray, values: dict[str, float], setup: SlingParams, *,
    parts: int = 1, refine: int = 1,
) -> np.ndarray:  # fmt: skip
    """Markers (T, M, 3) [m] of a rope that begins as a run (T, M, 3) does and whose ends follow it.

    Args:
        chords: Of the rope between markers [m], shape (M - 1,).
        values: Of NAMES [m, s, 1/s].
        parts: Edges between two markers.
        refine: Steps in a frame.
    """
    rope = rope_of(chords, parts, values["bending_length"], setup)
    theta = Parameters.of(
        NEO_HOOKEAN,
        np.array([YOUNG, POISSON, values["damping"], 0.0, 1.0]),
        air_drag=values["drag"],
    )
    time = np.arange(len(run)) / RATE
    fine = np.arange((len(run) - 1) * refine + 1) / (RATE * refine)
    led = CubicSpline(time, savgol_filter(run[:, LED], *SMOOTH, axis=0))(fine)
    table = steps(fine, fine[1], grip=Grip.FREE, order=2)
    table["past"][0], table["beta"][0] = 0, 1
    start, rates = begun(run, chords, parts)
    nodes = parts * np.arange(run.shape[1])
    done = march(
        ReferenceRod(rope, theta),
        table,
        start,
        friction=0.0,
        driven=Driven(nodes[list(LED)], led[1:], rates),
        exact=EXACT,
    )
    states = np.concatenate([start[None], done.x[refine - 1 :: refine]])
    return states[:, nodes, :3]


def inner(places: np.ndarray) -> np.ndarray:
    """Markers that nobody leads."""
    return places[:, LED[1] + 1 : LED[2]]


def fitted(
    run: np.ndarray, chords: np.ndarray, setup: SlingParams, *, parts: int = 1,
    start: dict[str, float] = START,
) -> dict[str, float]:  # fmt: skip
    """NAMES of a run, by least squares of the markers that nobody leads."""

    def left(logs: np.ndarray) -> np.ndarray:
        values: dict[str, float] = dict(zip(NAMES, np.exp(logs).tolist(), strict=True))
        try:
            summary = swing(run, chords, values, setup, parts=parts)
        except ArithmeticError:  # steps that do not converge: as far off as a rope is long
            summary = run + chords.sum()
        return (inner(summary) - inner(run)).ravel()

    low, high = np.log([REACH[name] for name in NAMES]).T
    begin = np.log([start[name] for name in NAMES])
    solution = least_squares(
        left, begin, bounds=(low, high), diff_step=1e-2, ftol=1e-3, xtol=1e-3, max_nfev=8
    )
    return dict(zip(NAMES, np.exp(solution.x).tolist(), strict=True))
