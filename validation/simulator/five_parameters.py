"""Checks that each of the five parameters does what its definition says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.simulator import ClampedBand, Parameters, interact
from pipeline.simulator.rubber import NEO_HOOKEAN
from validation.simulator.at_rest import STRING
from validation.simulator.closed import String
from validation.simulator.damping import oscillate
from validation.simulator.experiment import band_of, held_straight
from validation.simulator.finding import Bench, Measure, Theme, off
from validation.synthetic import pull_and_release

THETA = (6e5, 0.45, 5e-3, 0.6, 0.8)
THIN = f"a string {STRING} times thinner than the band"
SLIP = "the band slipped out of the fingers"


def _with(**changes: float | np.ndarray) -> Parameters:
    return Parameters.of(NEO_HOOKEAN, THETA).changed(**changes)


def held_force(
    bench: Bench, sling: ClampedBand, parameters: Parameters, when: float = 7.9
) -> np.ndarray:
    """Force (N,) on the hand in the yardstick's pause before the release."""
    episode = pull_and_release("band", bench.params.episode, sling)
    done = interact(sling, episode, parameters, **bench.on)
    force = np.linalg.norm(done.force[:, np.argmin(np.abs(done.times - when))], axis=1)
    return np.where([reason is None for reason in done.failure], force, np.nan)


def young(bench: Bench) -> list[Measure]:
    sling = replace(band_of(bench), mass=1e-4, grip_force=1e5)
    single, two = held_force(bench, sling, _with(youngs_modulus=THETA[0] * np.array([1.0, 2.0])))
    return [
        Measure(
            "held force at 2 E over that at E",
            "2",
            off(two / single, 2.0),
            "%",
            0.5,
            f"{two / single:.4f}; a weightless band in the episode, held fast",
        )
    ]


def poisson(bench: Bench, stretch: float = 1.5) -> list[Measure]:
    """Volume of a straight, held string, and its pull at given E, from nu 0.30 to 0.49."""
    sling = band_of(bench)
    sling = replace(sling, radius=sling.radius / STRING)
    thetas = _with(poissons_ratio=np.array([0.30, 0.49]))
    sling, motion = held_straight(bench, sling, stretch, thetas, double=True)
    strings = [String.of(sling, theta) for theta in thetas.theta]
    edge = sling.middle // 2  # away from the ends
    sections = motion.x[:, -1]
    g = (sections[:, edge + 1, :3] - sections[:, edge, :3]) / sling.edge_lengths[edge]
    volume = np.einsum("ij,ij->i", g, np.cross(sections[:, edge, 3:6], sections[:, edge, 6:9]))
    expected = np.array([float(string.volume(stretch)) for string in strings])
    pull = -motion.force[:, -1, 0]
    ratio = float(strings[1].force(stretch) / strings[0].force(stretch))
    return [
        Measure(
            f"volume that a string gains at stretch {stretch:g}, ν 0.30 and 0.49",
            "J − 1 = μ/λ (1 − 1/l)",
            off(volume - 1, expected - 1),
            "%",
            1.0,
            f"{100 * (volume[0] - 1):.2f} % and {100 * (volume[1] - 1):.2f} %; {THIN}",
        ),
        Measure(
            "pull at ν 0.49 over that at ν 0.30, same E",
            "P = μ (l − J/l²)",
            off(pull[1] / pull[0], ratio),
            "%",
            0.5,
            f"{pull[1] / pull[0]:.4f}; {THIN}",
        ),
    ]


def damping(bench: Bench) -> list[Measure]:
    """Decay of the heavy middle: d scales it, s its shape part and not its volume part."""

    def decay(d: float, s: float) -> tuple[float, float]:
        theta = (1e6, 0.30, d, THETA[3], s)
        _, _, fitted, closed = oscillate(bench, theta)
        return fitted[1], closed[1]

    base, closed = decay(1e-2, 1.0)
    twice, _ = decay(2e-2, 1.0)
    half, _ = decay(1e-2, 0.5)
    none, closed_none = decay(1e-2, 0.0)
    volume = closed_none / closed
    return [
        Measure(
            "decay at 2 d over that at d",
            "2",
            off(twice / base, 2.0),
            "%",
            1.0,
            f"{twice / base:.4f}; along the band, ν 0.30, s 1; {THIN}",
        ),
        Measure(
            "decay lost from s = 1 to s = 0.5",
            "half of the shape part",
            off((base - half) / (base - none), 0.5),
            "%",
            1.0,
            f"{(base - half) / (base - none):.4f} of what is lost from 1 to 0; {THIN}",
        ),
        Measure(
            "decay that is left at s = 0, over that at s = 1",
            "the volume part, d (λ − μ/3) J'²",
            off(none / base, volume),
            "%",
            2.0,
            f"{none / base:.4f}, closed form {volume:.4f}; {THIN}",
        ),
    ]


def friction(bench: Bench, count: int = 33) -> list[Measure]:
    """Coulomb: pads with the normal force N hold a pull of 2 mu N; then they open."""
    sling = band_of(bench)
    episode = pull_and_release("band", bench.params.episode, sling)
    strong = interact(replace(sling, grip_force=1e5), episode, _with(), device=bench.device)
    held = strong.times <= episode.release_time + 1e-9
    force = np.linalg.norm(strong.force[0], axis=1)
    peak = force[held].max()
    least = peak / (2 * sling.grip_force)
    tries = least * np.linspace(0.98, 1.02, count)
    reasons = interact(sling, episode, _with(dynamic_friction=tries), **bench.on).failure
    holds = np.array([reason is None for reason in reasons])
    named = all(reason in (None, SLIP) for reason in reasons)
    threshold = tries[holds].min() if holds.any() and named else np.nan

    mu = max(2 * least, 0.05)
    open_ = interact(sling, episode, _with(dynamic_friction=mu), device=bench.device)
    size, times = np.linalg.norm(open_.force[0], axis=1), open_.times - episode.release_time
    first = np.argmin(np.abs(times))
    window = (times > 1e-9) & (times <= sling.finger_opening_time)
    rate = 2 * mu * sling.grip_force / sling.finger_opening_time
    expected = np.maximum(size[first] - rate * times[window], 0)
    miss = 100 * np.abs(size[window] - expected).max() / size[first]
    return [
        Measure(
            "least friction that holds the pull",
            "Coulomb, F = 2 μ N",
            off(threshold, least),
            "%",
            0.25,
            f"{threshold:.4f}; {peak:.2f} N, pads of {sling.grip_force:g} N; below it: “{SLIP}”",
        ),
        Measure(
            "θ below it that do not slip",
            "0",
            float(holds[tries < 0.999 * least].sum()),
            "θ",
            0.0,
            f"of {int((tries < 0.999 * least).sum())}",
        ),
        Measure(
            "force while the fingers open",
            f"pull − 2 μ N t / T, T {1e3 * sling.finger_opening_time:g} ms",
            float(miss),
            "% of the pull",
            0.1,
            f"gone after {1e3 * size[first] / rate:.2f} ms of T",
        ),
    ]


def section(bench: Bench) -> Theme:
    return Theme(
        "The five parameters",
        [*young(bench), *poisson(bench), *damping(bench), *friction(bench)],
        "Each changes the episode as its definition says.",
    )
