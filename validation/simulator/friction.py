"""Coulomb's friction: what the pads hold, and what is left while they open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sling2sim2real.simulator import Parameters, interact
from sling2sim2real.simulator.rubber import NEO_HOOKEAN
from validation.simulator.experiment import band_of
from validation.simulator.finding import Bench, Measure, Theme, off
from validation.synthetic import pull_and_release

THETA = (6e5, 0.45, 5e-3, 0.6, 0.8)
SLIP = "the band slipped out of the fingers"


def _with(friction: float | np.ndarray) -> Parameters:
    return Parameters.of(NEO_HOOKEAN, THETA).changed(dynamic_friction=friction)


def friction(bench: Bench, count: int = 33) -> list[Measure]:
    """Pads with the normal force N hold a pull of 2 mu N; then they open."""
    sling = band_of(bench)
    episode = pull_and_release("band", bench.params.episode, sling)
    strong = replace(sling, grip_force=1e5)
    strong = interact(strong, episode, _with(THETA[3]), device=bench.device)
    held = strong.times <= episode.release_time + 1e-9
    peak = np.linalg.norm(strong.force[0], axis=1)[held].max()
    least = peak / (2 * sling.grip_force)
    tries = least * np.linspace(0.98, 1.02, count)
    reasons = interact(sling, episode, _with(tries), **bench.on).failure
    holds = np.array([reason is None for reason in reasons])
    named = all(reason in (None, SLIP) for reason in reasons)
    threshold = tries[holds].min() if holds.any() and named else np.nan

    mu = max(2 * least, 0.05)
    open_ = interact(sling, episode, _with(mu), device=bench.device)
    size, times = np.linalg.norm(open_.force[0], axis=1), open_.times - episode.release_time
    first = np.argmin(np.abs(times))
    window = (times > 1e-9) & (times <= sling.finger_opening_time)
    rate = 2 * mu * sling.grip_force / sling.finger_opening_time
    expected = np.maximum(size[first] - rate * times[window], 0)
    miss = 100 * np.abs(size[window] - expected).max() / size[first]
    return [
        Measure(
            "least friction that holds the pull", "Coulomb, F = 2 μ N",
            off(threshold, least), "%", 0.25,
            f"{threshold:.4f}; {peak:.2f} N, pads of {sling.grip_force:g} N; below it: “{SLIP}”",
        ),
        Measure(
            "θ below it that do not slip", "0",
            float(holds[tries < 0.999 * least].sum()), "θ", 0.0,
            f"of {int((tries < 0.999 * least).sum())}",
        ),
        Measure(
            "force while the fingers open",
            f"pull − 2 μ N t / T, T {1e3 * sling.finger_opening_time:g} ms",
            float(miss), "% of the pull", 0.1,
            f"gone after {1e3 * size[first] / rate:.2f} ms of T",
        ),
    ]  # fmt: skip


def section(bench: Bench) -> Theme:
    text = "The yardstick of `sling bench`, with pads that just hold it and just do not."
    return Theme("Friction", friction(bench), text)
