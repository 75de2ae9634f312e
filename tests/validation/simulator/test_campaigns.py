"""Launches converged within 0.5 %, random parameters finite or failed by name; small sizes."""

from __future__ import annotations

import numpy as np

from validation.simulator import launching, robustness

from .kept import assert_kept


def test_launches_are_converged_in_steps(bench):
    assert_kept(launching.convergence(bench, count=6, meshes=(), progress=str))


def test_launches_converge_at_second_order(bench):
    assert_kept(launching.order_in_time(bench, count=6))


def test_launches_are_as_many_as_asked_for():
    for count in (3, launching.COUNT + 5):
        theta, draws = launching.random_launches(count)
        assert theta.shape == (count, 5) and draws.shape == (count, 2)


def test_launches_fly_freely_and_gain_no_more_than_is_stored(bench):
    assert_kept(launching.physics(bench, count=4))


def test_random_thetas_are_finite_or_fail_by_name(bench):
    found = robustness.section(bench, count=200, launches=50, faces=100, progress=str)
    assert found.details["surveys"]["held_fast"]["rollouts"] == 200
    assert found.details["surveys"]["corners"]["rollouts"] == 32
    assert_kept(found.checks)


def test_faces_lie_at_a_bound(bench):
    box = bench.params.parameters
    thetas = robustness.on_faces(bench, 20)
    for number, name in enumerate(robustness.THETA):
        bounds = getattr(box, name)
        at = np.isclose(thetas[:, number, None], [bounds.low, bounds.high])
        assert at.sum(0).tolist() == [2, 2]
