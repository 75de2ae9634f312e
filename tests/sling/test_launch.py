"""Launches: ballistics in closed form, convergence, energy, failures by name."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from pipeline.sling import launch, solver
from pipeline.sling.initial import drawn_guess
from pipeline.sling.launch import ballistic_landing
from pipeline.sling.model import GRAVITY
from tests.sling.bands import DRAW, THETA, random_draws
from validation.simulator.reference import ReferenceRod


def test_ballistic_landing_in_closed_form():
    angle, speed, height = np.deg2rad(35.0), 4.0, 0.52
    drop = np.sqrt((speed * np.sin(angle)) ** 2 + 2 * GRAVITY * height)
    expected = speed * np.cos(angle) * (speed * np.sin(angle) + drop) / GRAVITY
    landing = ballistic_landing(0.0, 0.0, speed * np.cos(angle), speed * np.sin(angle), -height)
    assert landing == pytest.approx(expected, rel=1e-12)


def test_landing_is_the_flight_from_the_leaving_state(sling):
    shot = launch(sling, THETA, DRAW)
    assert shot.failure == [None]
    vy = shot.speed[0] * np.cos(shot.angle[0])
    vz = shot.speed[0] * np.sin(shot.angle[0])
    y = ballistic_landing(shot.separation_y[0], shot.separation_z[0], vy, vz, -sling.fork_height)
    assert shot.landing_y[0] == pytest.approx(y, rel=1e-9)
    assert -0.3 < shot.separation_y[0] < -0.1  # the band goes slack about 0.2 m before the fork


def test_launch_is_converged_in_time(sling):
    rng = np.random.default_rng(5)
    thetas = np.column_stack(
        [
            10 ** rng.uniform(5.2, 6.2, 16),
            rng.uniform(0.3, 0.49, 16),
            10 ** rng.uniform(-3.5, -2.2, 16),
            np.full(16, 0.5),
            rng.uniform(0, 1, 16),
        ]
    )
    draws = random_draws(16, rng)
    coarse = launch(sling, thetas, draws, workers=2)
    fine = launch(sling, thetas, draws, refine=10, double=True, workers=2)
    assert coarse.failure == fine.failure == [None] * 16
    assert coarse.speed == pytest.approx(fine.speed, rel=5e-3)


def test_projectile_gets_no_more_than_the_stored_energy(sling):
    """Little damping: most of the energy; much damping: less of it; never more than there is."""
    rod, drawn = ReferenceRod(sling, tuple(THETA)), drawn_guess(sling, np.array([DRAW]))[0]
    stored = rod.elastic(drawn) + rod.weight(drawn)
    thetas = np.tile(THETA, (3, 1))
    thetas[:, 2] = 1e-4, 5e-3, 2e-2
    shots = launch(sling, thetas, DRAW)
    lifted = sling.projectile_mass * GRAVITY * (shots.separation_z - DRAW[1])
    assert np.all(sling.projectile_mass / 2 * shots.speed**2 + lifted < stored)
    assert np.all(np.diff(shots.speed) < 0)


def test_devices_that_share_a_batch_change_nothing(sling, monkeypatch):
    """Small batches stay on the first, and each launch gets its own theta."""
    rng = np.random.default_rng(6)
    draws = np.column_stack([rng.uniform(-0.45, -0.2, 9), rng.uniform(-0.3, -0.1, 9)])
    thetas = np.column_stack([10 ** rng.uniform(5, 6.2, 9), np.tile(THETA[1:], (9, 1))])
    one, asked = launch(sling, thetas, draws), []

    def run(sling, schedule, slings, options):
        asked.append((options.device, len(slings)))
        return solver.run(sling, schedule, slings, options=replace(options, device="cpu"))

    module = import_module("pipeline.sling.launch")
    monkeypatch.setattr(module, "run", run)
    for share, expected in (
        (5, {("a", 9)}),
        (4, {("a", 5), ("b", 4)}),
        (1, {("a", 3), ("b", 3), ("c", 3)}),
    ):
        monkeypatch.setattr(module, "SHARE", share)
        asked.clear()
        several = launch(sling, thetas, draws, device=("a", "b", "c"))
        assert set(asked) == expected and several.failure == one.failure
        for name in ("landing_y", "speed", "angle", "hold_force", "separation_time"):
            np.testing.assert_array_equal(getattr(several, name), getattr(one, name))
    assert 0 < sum(reason is None for reason in one.failure) < 9


def test_failures_have_names(sling):
    strong = launch(sling, [5e6, 0.45, 2e-3, 0.5, 1.0], DRAW, max_force=30.0)
    assert "30 N" in strong.failure[0] and np.isnan(strong.landing_y[0])
    assert strong.hold_force[0] > 30
    slack = launch(sling, THETA, [-0.15, -0.05])
    assert slack.failure[0] is not None and np.isnan(slack.landing_y[0])


def test_farther_draws_land_farther(sling):
    landings = launch(sling, THETA, [[-0.34, -0.2], [-0.38, -0.2], [-0.42, -0.2]]).landing_y
    assert np.all(np.diff(landings) > 0.2)
