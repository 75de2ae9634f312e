"""Checks at rest: pull of a string, bending of beams, torsion of the cylinder, in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sling2sim2real.simulator import launch
from sling2sim2real.simulator.model import GRAVITY
from sling2sim2real.simulator.parameters import Parameters
from validation.simulator.closed import String, cantilever, clamped_beam
from validation.simulator.experiment import (
    TIGHT,
    band_of,
    held_straight,
    rest,
    setup_of,
    straight,
    straight_guess,
)
from validation.simulator.finding import Bench, Measure, Theme, off
from validation.simulator.reference import ReferenceRod

PULL_LIMIT, VOLUME_LIMIT, BEAM_LIMIT, TORSION_LIMIT = 0.5, 1.0, 3.0, 5.0  # percent
YOUNG = (3e4, 2e5, 1e6, 1e7)
POISSON = (0.30, 0.40, 0.45, 0.49)
STRETCH = (1.2, 1.6, 2.2)
DRAWN = (1.6, 2.2)  # stretches of a draw; below them the turns at its ends matter
STRING = 5  # times thinner than the band: the held sections at its ends hardly count
THIN = f"a string {STRING} times thinner than the band"
BEAM_POISSON = (0.30, 0.45, 0.49)
BEAM_YOUNG = 1e7
MESH = "; the mesh's doing: about 3.1 % with edges graded by 10 instead of 8"


def thetas(young=YOUNG, poisson=POISSON) -> np.ndarray:
    """Every pair of E and nu, shape (N, 5)."""
    return np.array([[e, nu, 2e-3, 0.5, 1.0] for e in young for nu in poisson])


def straight_pull(bench: Bench, stretch: float, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measured and closed-form pull (N,) of a straight string; its other half is at its length."""
    sling = band_of(bench)
    sling = replace(sling, radius=sling.radius / STRING)
    sling, motion = held_straight(bench, sling, stretch, Parameters.of(sling.law, theta))
    measured = np.where(motion.failed, np.nan, -motion.force[:, -1, 0])
    return measured, np.array([float(String.of(sling, row).force(stretch)) for row in theta])


def drawn_pull(bench: Bench, depth: float, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measured and closed-form hold force (N,) of a weightless band drawn at the fork."""
    sling, setup = replace(band_of(bench), mass=1e-4), setup_of(bench, projectile_mass=1e-6)
    half = np.hypot(depth, sling.half_width)
    stretch = 2 * half / sling.rest_length
    parameters = Parameters.of(sling.law, theta)
    done = launch(sling, setup, parameters, [-depth, 0.0], **bench.on)
    strings = [String.of(sling, row) for row in theta]
    expected = [2 * float(string.force(stretch)) * depth / half for string in strings]
    return done.hold_force, np.array(expected)


def pull(bench: Bench, theta: np.ndarray | None = None, stretches=STRETCH) -> list[Measure]:
    """Pull forces in single precision, the default."""
    theta = thetas() if theta is None else theta
    against = "closed form in uniaxial stress, P = μ (λ − J/λ²)"
    checks = [
        Measure(
            f"pull of a straight string at stretch {stretch:g}, worst of E and ν", against,
            off(*straight_pull(bench, stretch, theta)), "%", PULL_LIMIT,
            f"{THIN}; {len(theta)} pairs, E 0.03–10 MPa, ν 0.30–0.49, single precision",
        )
        for stretch in stretches
    ]  # fmt: skip
    width, length = band_of(bench).half_width, band_of(bench).rest_length
    for stretch in DRAWN:
        depth = np.sqrt((stretch * length / 2) ** 2 - width**2)
        checks.append(Measure(
            f"hold force of a draw of {depth:.2f} m (stretch {stretch:g}), worst of E and ν",
            f"two straight strings, {against}",
            off(*drawn_pull(bench, depth, theta)), "%", PULL_LIMIT,
            "as `launch` gives it, single precision; bending at tips and pouch hardly counts",
        ))  # fmt: skip
    return checks


def volume(bench: Bench, stretch: float = 1.5) -> list[Measure]:
    """Volume of a straight, held string at nu 0.30 and 0.49."""
    sling = band_of(bench)
    sling = replace(sling, radius=sling.radius / STRING)
    theta = thetas(young=(6e5,), poisson=(0.30, 0.49))
    parameters = Parameters.of(sling.law, theta)
    sling, motion = held_straight(bench, sling, stretch, parameters, double=True)
    edge = sling.middle // 2  # away from the ends
    sections = motion.x[:, -1]
    g = (sections[:, edge + 1, :3] - sections[:, edge, :3]) / sling.edge_lengths[edge]
    found = np.einsum("ij,ij->i", g, np.cross(sections[:, edge, 3:6], sections[:, edge, 6:9]))
    expected = np.array([float(String.of(sling, row).volume(stretch)) for row in theta])
    return [
        Measure(
            f"volume that a string gains at stretch {stretch:g}, ν 0.30 and 0.49",
            "J − 1 = μ/λ (1 − 1/l)",
            off(found - 1, expected - 1), "%", VOLUME_LIMIT,
            f"{100 * (found[0] - 1):.2f} % and {100 * (found[1] - 1):.2f} %; {THIN}",
        )
    ]  # fmt: skip


def _beam(bench: Bench, poisson: float, clamped: tuple[bool, bool]) -> float:
    """Deflection over Euler-Bernoulli's, of a band so light that it stays nearly straight."""
    sling = band_of(bench)
    sling = straight(sling, sling.rest_length, clamped=clamped, mass=sling.mass / 200)
    theta = Parameters.of(sling.law, [BEAM_YOUNG, poisson, 2e-3, 0.5, 1.0])
    sections = rest(bench, sling, theta, straight_guess(sling), double=True)
    load = sling.mass * GRAVITY / sling.rest_length
    rigidity = BEAM_YOUNG * np.pi * sling.radius**4 / 4
    both = all(clamped)
    closed = clamped_beam if both else cantilever
    node = sling.middle if both else -1
    return -sections[node, 2] / closed(load, sling.rest_length, rigidity)


def beams(bench: Bench, poissons=BEAM_POISSON) -> list[Measure]:
    edges, checks = band_of(bench).edges, []
    for name, clamped, formula in (
        ("cantilever", (True, False), "q L⁴ / 8 E I"),
        ("beam clamped at both ends", (True, True), "q L⁴ / 384 E I"),
    ):
        for poisson in poissons:
            ratio = _beam(bench, poisson, clamped)
            checks.append(Measure(
                f"deflection of a {name}, ν {poisson:.2f}", f"Euler–Bernoulli, {formula}",
                off(ratio, 1.0), "%", BEAM_LIMIT,
                f"{ratio:.4f} of it on {edges} edges, E {BEAM_YOUNG / 1e6:g} MPa, double precision"
                + (MESH if all(clamped) else ""),
            ))  # fmt: skip
    return checks


def torque_ratio(bench: Bench, angle: float, poisson: float) -> float:
    """Torque on the last clamp over G J angle / L, from the energy of the band at rest."""
    sling = band_of(bench)
    sling = straight(sling, sling.rest_length, clamp_twist=angle)
    young = 1e6
    theta = Parameters.of(sling.law, [young, poisson, 2e-3, 0.5, 1.0])
    sections = rest(bench, sling, theta, straight_guess(sling), gravity=0.0, **TIGHT)
    step = 1e-5
    sides = [
        ReferenceRod(replace(sling, clamp_twist=angle + turn), theta).elastic(sections)
        for turn in (step, -step)
    ]
    shear = young / (2 * (1 + poisson))
    expected = shear * np.pi * sling.radius**4 / 2 * angle / sling.rest_length
    return (sides[0] - sides[1]) / (2 * step) / expected


def torsion(bench: Bench, poissons=BEAM_POISSON) -> list[Measure]:
    checks = []
    for poisson in poissons:
        ratio = torque_ratio(bench, 0.1, poisson)
        checks.append(Measure(
            f"torque at a twist of 0.1 rad, ν {poisson:.2f}", "torsion of a cylinder, G J θ / L",
            off(ratio, 1.0), "%", TORSION_LIMIT, f"{ratio:.4f} of it",
        ))  # fmt: skip
    return checks


def section(bench: Bench) -> Theme:
    return Theme(
        "At rest",
        [*pull(bench), *volume(bench), *beams(bench), *torsion(bench)],
        "A straight band, drawn, loaded by its weight, or twisted at a clamp, after it has come to"
        f" rest. The string is a band {STRING} times thinner: the sections that clamp and fingers"
        " hold hardly count there. Beams are light enough to stay nearly straight.",
    )
