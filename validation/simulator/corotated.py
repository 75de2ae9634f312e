"""The law `corotated`: its string against PhysX's law, and the kernel's steps and energies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from sling2sim2real.engines.physx import law
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import COROTATED
from validation.simulator import agreement, damping, energy, launching
from validation.simulator.experiment import band_of, held_straight
from validation.simulator.finding import Bench, Measure, Theme, off

STRETCHES = (1.1, 1.5, 2.0, 3.0)
LIMITS = {0.30: 1.2, 0.40: 0.9, 0.45: 0.6, 0.49: 0.3}  # % of the pull, by Poisson's ratio
STRING, YOUNG = 5, 1e6  # times thinner than the band; Pa


def corotated_of(bench: Bench) -> ClampedBand:
    """The band of `band_of` with this law."""
    return replace(band_of(bench), law=COROTATED)


def physx_stress(stretch: float, young: float, poisson: float) -> float:
    """Nominal stress [Pa] of PhysX's law along a bar that is free across."""

    def stress(across: float) -> np.ndarray:
        return law.stress(np.diag([stretch, across, across]), young, poisson)

    return float(stress(brentq(lambda t: stress(t)[1, 1], 0.3, 1.2, xtol=1e-14))[0, 0])


def pull(bench: Bench, poisson: dict[float, float] | None = None) -> list[Measure]:
    """Pull of a straight string at STRETCHES; of each Poisson's ratio the worst."""
    sling = corotated_of(bench)
    sling = replace(sling, radius=sling.radius / STRING)
    checks = []
    for ratio, limit in (poisson or LIMITS).items():
        theta = Parameters.of(COROTATED, np.array([YOUNG, ratio, 2e-3, 0.5, 1.0]))
        measured, expected = [], []
        for stretch in STRETCHES:
            straight, motion = held_straight(bench, sling, stretch, theta, double=True)
            measured.append(np.nan if motion.failed[0] else -motion.force[0, -1, 0])
            expected.append(straight.area * physx_stress(stretch, YOUNG, ratio))
        checks.append(Measure(
            f"pull of a straight string, ν {ratio:g}, worst of stretches"
            f" {', '.join(f'{stretch:g}' for stretch in STRETCHES)}",
            "PhysX's law in uniaxial stress, P = 2 μ (F − R) + λ (J − 1) cof F",
            off(measured, expected), "%", limit,
            "the rod's addition is that of a string which keeps its volume",
        ))  # fmt: skip
    return checks


def growth(bench: Bench, count: int = 16) -> list[Measure]:
    """Energy after random states are let go."""
    thetas = Parameters.of(COROTATED, agreement.random_thetas(bench, count, 11))
    return damping.growth(bench, corotated_of(bench), thetas)


def section(bench: Bench) -> Theme:
    sling = corotated_of(bench)
    return Theme(
        "The law corotated",
        [
            *pull(bench),
            *agreement.checks(bench, 2, sling=sling),
            *growth(bench),
            *energy.checks(energy.balance(bench, sling=sling)),
            *launching.convergence(bench, sling=sling),
        ],
        "The law of PhysX's deformable volumes, which the paper's engine has"
        " (`sling2sim2real/engines/physx/law.py`), along the band.",
    )
