"""Damping: no step gains energy, and a heavy middle decays as the oscillator it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.rubber import RUBBER
from validation.simulator.agreement import random_thetas
from validation.simulator.at_rest import STRING
from validation.simulator.closed import String, oscillation
from validation.simulator.energy import remembered
from validation.simulator.experiment import (
    band_of,
    launched,
    move,
    settling,
    straight,
    straight_guess,
)
from validation.simulator.finding import Bench, Measure, Theme, off
from validation.simulator.reference import ReferenceRod

SEED = 11
ROUNDING = 1e-9  # of the energy at the start
COUNT, STEPS = 48, 60  # random states of a kind, and steps from each
# m, a tenth of the default: it is the steps that must not gain energy, not what Newton's method
# leaves of them, which is up to 1e-6 of the start in one step of an inverted band
TOLERANCE_M = 2e-7
FORMULAS = (1, "recoil_step"), (2, "recoil_step"), (2, "swing_step")  # order, and whose length
FREQUENCY_LIMIT, DECAY_LIMIT = 1.0, 2.0  # percent
STRETCH, MASS = 1.5, 0.5  # of the band whose middle is heavy; kg
PERIODS, PER_PERIOD = 4, 800  # of its oscillation, and steps in each
STATES = {  # stretch along the band, across it, and how rough: share of each
    "near rest": ((0.98, 1.02), (0.98, 1.02), 0.02),
    "stretched": ((1.2, 2.2), (0.6, 1.0), 0.05),
    "slack": ((0.6, 1.0), (1.0, 1.3), 0.05),
    "compressed": ((0.4, 0.9), (0.5, 0.9), 0.05),
    "inverted": ((-1.2, -0.2), (0.7, 1.2), 0.1),
    "far from rest": ((0.3, 2.0), (0.3, 2.0), 0.5),
}


def random_states(sling: ClampedBand, kind: str, count: int, rng) -> np.ndarray:
    """Rough states (count, L, 9) of a straight band."""
    along, across, rough = STATES[kind]
    result = np.tile(straight_guess(straight(sling, sling.rest_length)), (count, 1, 1))
    for sections in result:
        g = np.tile([rng.uniform(*along), 0.0, 0.0], (sling.edges, 1))
        g += rough * rng.normal(size=g.shape)
        sections[1:, :3] = sections[0, :3] + np.cumsum(g * sling.edge_lengths[:, None], axis=0)
        sections[:-1, 3:] *= rng.uniform(*across)
        sections[:-1, 3:] += rough * rng.normal(size=(sling.edges, 6))
    return result


def recoil(
    bench: Bench, sling: ClampedBand, parameters: Parameters, kind: str, order: int, h: float,
    **options,
) -> np.ndarray:  # fmt: skip
    """Energy of N bands over that of their random start, with ends clamped and free.

    Elastic, kinetic and the branches' (of the law `rubber`), without gravity. Bands that did not
    converge, and say so, are left out. `options` are those of the solver.

    Returns:
        Shape (M, S + 1), in which M bands converged.
    """
    start = random_states(sling, kind, len(parameters), np.random.default_rng(SEED))
    table, energies = launched(h, STEPS, order), []
    for clamped in (True, False):
        loose = replace(straight(sling, sling.rest_length), clamped=(clamped, clamped))
        motion = move(bench, loose, parameters, table, start, gravity=0.0, **options)
        for k in np.flatnonzero(~motion.failed):
            rod = ReferenceRod(loose, parameters[[k]], gravity=0.0)
            first, total = rod.elastic(motion.start[k]), rod.kinetic(motion.v[k])
            if sling.law == RUBBER:
                memory = remembered(rod, table, motion.start[k], motion.x[k])
                rod, total = replace(rod, worst=memory.worst[1:]), total + memory.free
            total = total + rod.elastic(motion.x[k])
            energies.append(np.append(first, total) / first)
    return np.reshape(energies, (-1, len(table) + 1))


def growth(
    bench: Bench, sling: ClampedBand, parameters: Parameters, formulas=FORMULAS, **options
) -> list[Measure]:
    """Energy of the kernel's own steps from random states of every kind, with N parameters.

    A two-step method's may sway from step to step, and stays below that of the start.

    Args:
        options: Of the solver; it steps in double precision.
    """
    checks = []
    for order, name in formulas:
        h = getattr(bench.params.sling, name)
        options = {"double": True, "tolerance": TOLERANCE_M, **options}
        energies = [recoil(bench, sling, parameters, kind, order, h, **options) for kind in STATES]
        every = np.concatenate(energies)
        kept = ", ".join(f"{len(of)} {kind}" for of, kind in zip(energies, STATES, strict=True))
        rises = {"above the start": every - 1}
        if order == 1:
            rises["in any one step"] = np.diff(every, axis=1)
        steps = f"{'backward Euler' if order == 1 else 'second order'}, {1e3 * h:g} ms"
        for what, rise in rises.items():
            checks.append(Measure(
                f"rise of energy {what}, {steps}", "energy never grows without work",
                float(np.max(rise, initial=0.0)), "of the start", ROUNDING,
                f"kept of {2 * len(parameters)} random states and θ each: {kept}; others are"
                " marked failed",
            ))  # fmt: skip
    return checks


def oscillate(
    bench: Bench, theta, axis: int, turn_damping: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """A heavy middle of a thin, light band, let go 1 % of the rest length off its place.

    Args:
        theta: The five parameters.
        axis: 0 along the band, 1 across it.

    Returns:
        (frequency [1/s], decay [1/s]) as fitted and in closed form.
    """
    sling = band_of(bench)
    sling = replace(sling, radius=sling.radius / STRING, mass=sling.mass / 20)
    sling = straight(sling, sling.rest_length * STRETCH)
    amplitude = 0.01 * sling.rest_length
    string = String.of(sling, theta, turn_damping)
    parameters = Parameters.of(sling.law, theta, turn_damping=turn_damping)
    k, c = string.axial(STRETCH) if axis == 0 else string.transverse(STRETCH)
    moving = MASS + sling.mass / 3  # of the halves a third moves along
    target = np.zeros(3)
    target[axis] = amplitude
    before = settling(Grip.POUCH, target)
    h = 2 * np.pi * np.sqrt(moving / k) / PER_PERIOD
    table = np.concatenate([before, launched(h, PERIODS * PER_PERIOD)])
    start = straight_guess(sling, sling.half_width + (amplitude if axis == 0 else 0.0))
    options = {"payload": MASS, "gravity": 0.0, "double": True}
    motion = move(bench, sling, parameters, table, start, **options)
    place = motion.x[0, len(before) - 1 :, sling.middle, axis]
    time = h * np.arange(len(place))

    def miss(share: np.ndarray) -> np.ndarray:
        model = oscillation(time, moving, share[0] * k, share[1] * c, place[0])
        return (model - place) / amplitude

    def modes(stiffness: float, damping: float) -> tuple[float, float]:
        decay = damping / (2 * moving)
        return float(np.sqrt(stiffness / moving - decay**2) / (2 * np.pi)), float(decay)

    fit = least_squares(miss, [1.0, 1.0], xtol=1e-12, ftol=1e-12)
    return modes(fit.x[0] * k, fit.x[1] * c), modes(k, c)


def oscillator(bench: Bench, cases=None) -> list[Measure]:
    """Frequency and decay of the middle, along and across the band.

    Args:
        cases: Triples of nu, s and axis.
    """
    if cases is None:
        cases = [(nu, s, 0) for nu in (0.30, 0.49) for s in (0.5, 1.0)]
        cases += [(0.30, 0.0, 0), (0.45, 0.5, 1), (0.45, 1.0, 1)]
    checks = []
    for poisson, scale, axis in cases:
        theta = [1e6, poisson, 2e-2, 0.5, scale]
        fitted, closed = oscillate(bench, theta, axis, turn_damping=1.0)
        where = f"{('along', 'across')[axis]} the band, ν {poisson:.2f}, s {scale:g}"
        against = f"m x'' + c x' + k x = 0, k and c from E, ν, d, s at stretch {STRETCH:g}"
        for name, estimate, other, limit, unit in (
            ("frequency", fitted[0], closed[0], FREQUENCY_LIMIT, "Hz"),
            ("decay", fitted[1], closed[1], DECAY_LIMIT, "/s"),
        ):
            note = f"{estimate:.4g} {unit}, closed form {other:.4g} {unit}"
            checks.append(
                Measure(f"{name} {where}", against, off(estimate, other), "%", limit, note)
            )
    theta = [1e6, 0.45, 2e-2, 0.5, 1.0]
    slow = oscillate(bench, theta, 1, turn_damping=0.0)[0][1]
    fast = oscillate(bench, theta, 1, turn_damping=1.0)[1][1]
    checks.append(Measure(
        "decay across the band, turns not braked", "0: what only turns loses nothing",
        100 * slow / fast, "% of what it is where they are", DECAY_LIMIT,
        f"{slow:.4g} /s, where turns are braked {fast:.4g} /s in closed form",
    ))  # fmt: skip
    return checks


def section(bench: Bench) -> Theme:
    sling = band_of(bench)
    thetas = Parameters.of(sling.law, random_thetas(bench, COUNT, SEED))
    return Theme(
        "Damping",
        [*oscillator(bench), *growth(bench, sling, thetas)],
        "A heavy middle of a stretched, light string, a band made"
        f" {STRING} times thinner, decays as k and c in closed form say"
        " (`validation/simulator/closed.py`), across it where turns are braked (`turn_damping` 1),"
        " and hardly at all where they are not. Random states of the whole band, near rest and far"
        " from it, are let go without gravity, ends clamped or free, to see whether the"
        " simulator's own steps ever gain energy; Newton's method goes on to a tenth of the"
        " default's tolerance, with which one step of an inverted band gained 1e-6 of it."
        " Those that do not converge are marked failed and"
        " left out: most of the inverted states, turned inside out, and more than half of those"
        " far from rest.",
    )
