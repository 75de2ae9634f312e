"""Simulations are the library's, one by one or in a batch; a planned pull goes where it should."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real import Theta, pull, simulate, simulate_batch
from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.signal import as_recorded, cutoff_hz
from sling2sim2real.simulator.interaction import interact


def test_a_simulation_is_the_librarys(world) -> None:
    planned = pull(world)
    ours = simulate(world, planned)
    theirs = interact(world.sling, planned, world.theta.parameters)
    assert np.array_equal(ours.step_force, theirs.force[0])
    assert np.array_equal(ours.center_line, theirs.center_line[0])
    cutoff = cutoff_hz(world.settings.force.cutoff, world.settings.force.cutoff_unit)
    sampling = cutoff, 0.0, 0.03, len(planned.time)
    assert np.allclose(ours.force, as_recorded(theirs.times, theirs.force[0], *sampling), atol=1e-9)
    assert ours.failure is None and np.array_equal(ours.time, planned.time)


def test_a_batch_is_each_of_its_own(world) -> None:
    planned = pull(world)
    thetas = [replace(world.theta, youngs_modulus=1e4 * young) for young in range(10, 27)]
    some = simulate_batch(world, planned, thetas)  # more than share a vector
    assert len(some) == 17
    alone = simulate(replace(world, theta=thetas[16]), planned)
    assert np.array_equal(some[16].force, alone.force)
    assert not np.array_equal(some[0].force, some[16].force)


def test_a_band_that_slips_says_so(world) -> None:
    loose = replace(world, theta=replace(world.theta, dynamic_friction=0.05))
    assert "slipped" in simulate(loose, pull(loose)).failure


def test_a_batch_is_of_one_law(world) -> None:
    with pytest.raises(UserError, match="all of the model's law, rubber"):
        simulate_batch(world, pull(world), [world.theta, Theta(2e5, 0.47, 2e-3, 0.7, 0.6)])
    with pytest.raises(UserError, match="give some"):
        simulate_batch(world, pull(world), [])


def test_a_planned_pull_rests_at_its_ends(world) -> None:
    planned = pull(world, draw=(-0.35, -0.10), pull_time=2.0, pause=1.5, frame_rate=10.0)
    paused = (planned.time > planned.release_time - 1.5) & (planned.time < planned.release_time)
    assert np.allclose(planned.position[paused], [0, -0.35, -0.10])
    assert np.allclose(planned.velocity[0], 0) and np.allclose(planned.velocity[paused][2:-2], 0)
    assert np.allclose(np.diff(planned.cloud_time), 0.1)
    line = simulate(world, planned).center_line
    hand = np.interp(planned.cloud_time, planned.time, planned.position[:, 1])
    held = (planned.cloud_time > planned.grasp_time + 0.6) & (
        planned.cloud_time < planned.release_time
    )
    assert np.allclose(line[held, line.shape[1] // 2, 1], hand[held], atol=2e-3)


def test_a_pull_with_dips_lets_the_band_back(world) -> None:
    """By the ways of settings.plan, and it ends where it would without them."""
    for dips, back in ((False, 0.0), (True, sum(dip.depth for dip in world.settings.plan.dips))):
        planned = pull(world, dips=dips)
        way = planned.position[planned.time < planned.release_time, 1]
        assert np.diff(way).clip(min=0).sum() == pytest.approx(back, abs=0.01)
        assert way[-1] == pytest.approx(-0.4, abs=1e-3)


def test_a_pull_takes_time(world) -> None:
    with pytest.raises(UserError, match="must be above 0"):
        pull(world, pause=0.0)
