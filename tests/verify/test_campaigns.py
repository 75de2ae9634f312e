"""Launches converged within 0.5 %, random parameters finite or failed by name; small sizes."""

from __future__ import annotations

from pipeline.verify import launches, robustness

from .kept import assert_kept


def test_launches_are_converged_in_steps(bench):
    assert_kept(launches.convergence(bench, count=6, meshes=(), progress=str))


def test_launches_fly_freely_and_gain_no_more_than_is_stored(bench):
    assert_kept(launches.physics(bench, count=4))


def test_random_thetas_are_finite_or_fail_by_name(bench):
    found = robustness.section(bench, count=200, launches=50, progress=str)
    assert found.details["surveys"]["held_fast"]["rollouts"] == 200
    assert_kept(found.checks)
