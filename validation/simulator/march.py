"""Steps of the reference: Newton's method to machine precision on the equations of step.h."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.simulator.records import Grip, Mode
from validation.simulator.reference import ReferenceRod

EXACT = 1e-11  # Newton's change below which a step is done [m]
SMALL = 1e-30  # imaginary step: derivatives without cancellation


@dataclass(frozen=True)
class March:
    """States x and rates v after each step, shape (S, L, 9), and the force on the hand (S, 3)."""

    x: np.ndarray
    v: np.ndarray
    force: np.ndarray


def march(
    rod: ReferenceRod,
    steps: np.ndarray,
    start: np.ndarray,
    *,
    friction: float = np.inf,
) -> March:
    """Step `start` (L, 9), at rest, through a schedule's records (S,).

    Args:
        friction: 2 times the coefficient of friction: with the normal force what two pads can hold.
    """
    middle, weights = rod.sling.middle, rod.branches
    x1 = x2 = np.array(start, float)
    v1 = v2 = np.zeros_like(x1)
    drag = rod.value("air_drag") * replace(rod, payload=0.0).mass
    drag[:, 3:] = 0
    offset, pull, direction = None, 0.0, np.zeros(3)
    xs, vs, forces = [], [], []
    overstress = np.zeros((rod.sling.edges, len(weights)))
    stress = rod.uniaxial(rod.stretch(rod.columns(x1)))  # at the last step's end
    worst = np.broadcast_to(rod.worst, rod.sling.edges)
    for step in steps:
        h, past, grip, target = (step[name] for name in ("h", "past", "grip", "target"))
        bh = step["beta"] * h
        relax = step["mode"] == Mode.RELAX  # from rest, whatever was before
        forget, follow = rod.update(step, overstress)
        if relax:
            forget, follow, stress = 0 * forget, 0 * follow, 0 * stress
        band = replace(
            rod,
            share=step["bending"],
            gripped=grip == Grip.HELD,
            carried=(forget * overstress - np.outer(stress, follow)) @ weights,
            following=float(follow @ weights),
            worst=worst,
        )
        free = _free(band)
        at = x1 + h * v1
        if grip in (Grip.HELD, Grip.POUCH):
            offset = x1[middle, :3] - target if offset is None else offset
            at[middle, :3] = target + step["blend"] * offset
            free[middle, :3] = False
        else:
            offset = None
        y = x1 + past * (x1 - x2)
        inertial = y + bh * (v1 + past * (v1 - v2))
        inertial[:, 2] -= bh**2 * rod.gravity
        lost = step["grip_force"] * friction
        capacity = max(pull - lost, 0.0) if grip == Grip.OPENING else 0.0

        def residual(
            x, band=band, at=at, y=y, inertial=inertial, bh=bh, held_back=capacity * direction
        ):
            rate = (x - y) / bh
            force = band.mass * (x - inertial) / bh**2 + drag * rate + band.internal(x, rate, at)
            force[..., middle, :3] += held_back
            return force

        x = solve(residual, at, free)
        force = -residual(x)[middle, :3]
        if grip == Grip.HELD:
            pull = np.linalg.norm(force)
            direction = force / max(pull, 1e-9)
        if grip in (Grip.FREE, Grip.OPENING):
            force = capacity * direction
        v = (x - y) / bh
        if relax:
            x1, x2, v1, v2 = x, x, 0 * v, 0 * v
        else:
            x1, x2, v1, v2 = x, x1, v, v1
        stretch = rod.stretch(rod.columns(x))
        change, stress = -stress, rod.uniaxial(stretch)
        overstress = forget * overstress + np.outer(stress + change, follow)
        worst = np.maximum(rod.worst if relax else worst, rod.pulled(stretch))
        xs.append(x), vs.append(v1), forces.append(force)
    return March(*map(np.array, (xs, vs, forces)))


def _free(rod: ReferenceRod) -> np.ndarray:
    """Which degrees of freedom move, shape (L, 9): but for clamped nodes and the last directors."""
    free = np.ones((rod.sling.sections, 9), bool)
    free[[0, -1], :3] = ~np.array(rod.sling.clamped)[:, None]
    free[-1, 3:] = False
    return free


def solve(residual, start: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Newton's method from `start` on the `free` ones, down the step's potential.

    A residual is that potential's gradient. Where the Hessian is not positive, its diagonal is
    raised until it is; a step past the bottom, to where it is steeper than before, is halved.
    """
    x = start
    slope = residual(x)[free]
    for _ in range(100):
        step = np.zeros(x.shape)
        step[free] = _downhill(jacobian(residual, x)[free][:, free], slope)
        steep, scale = slope @ step[free], 1.0
        while True:
            after = x - scale * step
            slope = residual(after)[free]
            if not (-slope @ step[free] > steep and scale > 1e-4):
                break
            scale /= 2
        x = after
        if np.abs(step).max() < EXACT:  # the next one would be rounding
            return x
    raise ArithmeticError("the reference's Newton method did not converge")


def _downhill(hessian: np.ndarray, slope: np.ndarray) -> np.ndarray:
    diagonal, raised = np.abs(np.diag(hessian)), 0.0
    while True:
        try:
            factor = np.linalg.cholesky(hessian + raised * np.diag(diagonal))
            return np.linalg.solve(factor.T, np.linalg.solve(factor, slope))
        except np.linalg.LinAlgError:
            raised = max(4 * raised, 1e-3)


def jacobian(residual, x: np.ndarray) -> np.ndarray:
    """Jacobian of a residual in which a section meets its neighbours only, shape (L, 9, L, 9)."""
    sections = len(x)
    probes = np.zeros((3, 9, sections, 9))
    for i in range(sections):
        probes[i % 3, range(9), i, range(9)] = 1
    slopes = residual(x + 1j * SMALL * probes).imag / SMALL
    result = np.zeros((sections, 9, sections, 9))
    for i in range(sections):
        for row in range(max(i - 1, 0), min(i + 2, sections)):
            result[row, :, i] = slopes[i % 3, :, row].T
    return result
