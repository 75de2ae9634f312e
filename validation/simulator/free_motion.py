"""Free motion: what falls freely falls as the steps say, and momentum is kept."""

from __future__ import annotations

import numpy as np

from sling2sim2real.simulator.initial import sections_of
from sling2sim2real.simulator.model import GRAVITY, ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.schedule import steps
from validation.simulator.experiment import TIGHT, band_of, launched, move, straight, straight_guess
from validation.simulator.finding import Bench, Measure, Theme
from validation.simulator.reference import ReferenceRod

ROUNDING = 1e-11
ANGULAR_LIMIT = 1e-3  # of the parts' angular momenta
SHORT_OF_2 = 0.2  # an order of 1.8 is taken for second order
THETA = (5e5, 0.45, 0.0, 0.5, 1.0)


def uneven(count: int) -> np.ndarray:
    """Ends of steps between 0.5 and 2 ms, from 0, shape (count + 1,)."""
    return np.append(0.0, np.cumsum(1e-3 * 2.0 ** np.sin(np.arange(count))))


def fall_of_a_point(times: np.ndarray, order: int) -> np.ndarray:
    """Height of a point mass from rest at 0 by the textbook's formulas, shape (S + 1,).

    Backward Euler, or the second-order backward differentiation formula for uneven steps: the
    derivative at the newest point of the parabola through the last three (the first step is
    backward Euler's).
    """
    z, v = [0.0], [0.0]
    for n in range(1, len(times)):
        used = 1 if order == 1 or n == 1 else 2
        apart = times[n - used : n + 1] - times[n]
        weights = np.linalg.solve(np.vander(apart, increasing=True).T, np.eye(used + 1)[1])

        def newest(past: list[float], rate: float, weights=weights, used=used) -> float:
            return (rate - weights[:-1] @ past[-used:]) / weights[-1]

        v.append(newest(v, -GRAVITY))
        z.append(newest(z, v[-1]))
    return np.array(z)


def loose_band(bench: Bench) -> ClampedBand:
    sling = band_of(bench)
    return straight(sling, sling.rest_length, clamped=(False, False))


def free_fall(bench: Bench, count: int = 60) -> list[Measure]:
    sling, times = loose_band(bench), uneven(count)
    checks = []
    for order, name in ((1, "backward Euler"), (2, "second order, uneven steps")):
        table = steps(times, times[1], grip=Grip.FREE, order=order)
        for field, value in {"past": 0, "beta": 1}.items():
            table[field][0] = value
        theta = Parameters.of(sling.law, THETA)
        motion = move(bench, sling, theta, table, straight_guess(sling), **TIGHT)
        miss = np.abs(motion.x[0, :, :, 2] - fall_of_a_point(times, order)[1:, None]).max()
        fallen = -motion.x[0, -1, 0, 2]
        checks.append(Measure(
            f"height in free fall, {name}", "the steps' own solution for a point mass",
            float(miss / fallen), "of the fall", ROUNDING,
            f"{count} steps, {100 * fallen:.2g} cm, both ends free, double precision",
        ))  # fmt: skip
    return checks


def momenta(rod: ReferenceRod, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum (..., 3) about the origin; the sections' turning included."""
    moving = rod.mass * v
    linear = moving[..., :3].sum(-2)
    parts = [
        np.cross(x[..., k : k + 3], moving[..., k : k + 3])[..., : None if k == 0 else -1, :]
        for k in (0, 3, 6)
    ]
    return linear, sum(part.sum(-2) for part in parts)


def bent(sling: ClampedBand) -> np.ndarray:
    """Sections (L, 9) of a band stretched by up to 1.3 and bent in space.

    Stretch and curvature fade out towards the free ends, which bear neither pull nor moment: so
    no front runs in from them, and steps can show their order.
    """
    place = (sling.arc[1:] + sling.arc[:-1]) / 2 / sling.rest_length
    turn = place - np.sin(2 * np.pi * place) / (2 * np.pi) - 0.5
    rise = 0.3 * (place - np.sin(4 * np.pi * place) / (4 * np.pi) - 0.5)
    along = [np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)]
    length = sling.edge_lengths * (1 + 0.3 * np.sin(np.pi * place) ** 2)
    nodes = np.zeros((sling.sections, 3))
    nodes[1:] = np.cumsum(length[:, None] * np.transpose(along), axis=0)
    return sections_of(sling, nodes - nodes.mean(0))


def recoil(bench: Bench, h: float, order: int, span: float = 0.02) -> tuple[float, float]:
    """Momenta of a bent, stretched band let go at rest, in shares of what its parts have.

    Returns:
        Largest linear and largest angular momentum that appear.
    """
    sling = loose_band(bench)
    sections = bent(sling)
    theta = Parameters.of(sling.law, THETA)
    table = launched(h, int(round(span / h)), order)
    motion = move(bench, sling, theta, table, sections, gravity=0.0, **TIGHT)
    x, v = motion.x[0], motion.v[0]
    rod = ReferenceRod(sling, theta, gravity=0.0)
    linear, angular = momenta(rod, x, v)
    moving = np.abs(rod.mass * v)
    speed = moving[..., :3].sum((-2, -1)).max()
    turning = np.linalg.norm(np.cross(x[..., :3], (rod.mass * v)[..., :3]), axis=-1).sum(-1).max()
    return (
        float(np.linalg.norm(linear, axis=-1).max() / speed),
        float(np.linalg.norm(angular, axis=-1).max() / turning),
    )


def momentum(bench: Bench) -> list[Measure]:
    """Linear momentum to rounding; angular momentum as far as the steps keep it."""
    step = bench.params.sling.recoil_step
    checks = []
    for order, name in ((1, "backward Euler"), (2, "second order")):
        linear, coarse = recoil(bench, step, order)
        _, fine = recoil(bench, step / 2, order)
        checks.append(Measure(
            f"linear momentum out of nothing, {name}", "conservation",
            linear, "of the parts'", ROUNDING,
            "recoil of a bent, stretched band with free ends, double precision",
        ))  # fmt: skip
        checks.append(Measure(
            f"angular momentum out of nothing, {name}, no damping", "conservation",
            coarse, "of the parts'", ANGULAR_LIMIT,
            f"steps of {1e3 * step:g} ms; half of them leave {fine:.2g}: order"
            f" {np.log2(coarse / fine):.2f}",
        ))  # fmt: skip
    checks.append(  # of the second order, the last of both
        Measure(
            "order of angular momentum in time, second order, what it is short of 2",
            "conservation",
            float(np.maximum(2 - np.log2(coarse / fine), 0.0)),
            "",
            SHORT_OF_2,
            f"{coarse:.2g} and {fine:.2g} at steps of {1e3 * step:g} ms and half of them",
        )
    )
    return checks


def section(bench: Bench) -> Theme:
    return Theme(
        "Free motion",
        [*free_fall(bench), *momentum(bench)],
        "A band whose ends are free, in double precision.",
    )
