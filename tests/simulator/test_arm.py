"""An arm that gives way: it is sent to the draw, and rests where its spring holds the band."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.simulator import launch
from sling2sim2real.simulator.initial import drawn_guess
from sling2sim2real.simulator.launch import memory_of_pull, schedule_of
from sling2sim2real.simulator.model import LaunchHistory
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import NEO_HOOKEAN, RUBBER
from sling2sim2real.simulator.schedule import Schedule
from sling2sim2real.simulator.solver import Options, Slings, run
from tests.simulator.bands import DRAW, THETA, neo, random_draws, random_thetas

ARM = 12000.0
LONG_HELD = LaunchHistory(4.0, 2.0)


def held(sling, setup, parameters, draws):
    """How far the middle rests from where it is sent (N, 3), and the force on the hand there."""
    whole = schedule_of(setup)
    schedule = Schedule(whole.steps[: whole.first_free], whole.first_free)
    guess = drawn_guess(sling, draws)
    slings = Slings.of(
        sling,
        parameters,
        guess,
        payload=setup.projectile_mass,
        **memory_of_pull(sling, setup.history, parameters, draws),
    )
    done = run(sling, schedule, slings, options=Options(double=True))
    assert not done.lanes["outcome"].any()
    moved = (done.state - guess)[:, sling.middle]
    return moved, done.lanes["hold_force"]


@pytest.mark.parametrize("stiffness", [ARM, 1500.0])
@pytest.mark.parametrize("law", [NEO_HOOKEAN, RUBBER])
def test_band_and_arm_are_springs_in_series(sling, launch_setup, law, stiffness):
    """The pouch moves by force over stiffness; the force is less by the band's slope."""
    two = np.array([THETA, THETA])
    shape = {} if law == NEO_HOOKEAN else {"mooney_share": 0.4, "relaxation": 0.02}
    band, thetas = replace(sling, law=law), Parameters.of(law, two, **shape)
    stiff = replace(launch_setup, history=LONG_HELD)
    draws = np.array([DRAW, [-0.44, -0.12]])
    moved, force = held(band, replace(stiff, arm_stiffness=stiffness), thetas, draws)
    np.testing.assert_allclose(moved[:, :3], force / stiffness, rtol=1e-3, atol=1e-9)
    nearer = draws - 1e-3 * draws / np.linalg.norm(draws, axis=1, keepdims=True)
    firm, less = (
        np.linalg.norm(held(band, stiff, thetas, at)[1], axis=1) for at in (draws, nearer)
    )
    slope = (firm - less) / 1e-3
    series = firm / (1 + slope / stiffness)
    assert np.all(slope > 30)
    near = 5e-4 if stiffness == ARM else 5e-3  # the slope is that of the last millimetre
    assert np.linalg.norm(force, axis=1) == pytest.approx(series, rel=near)


def test_it_costs_of_a_landing_what_it_costs_of_the_draw(sling, launch_setup):
    """As a firm arm from where it rests, a millimetre or two nearer."""
    theta = neo(THETA)
    gives = replace(launch_setup, arm_stiffness=ARM)
    force = held(sling, gives, theta, np.array([DRAW]))[1][0]
    firm, soft = (launch(sling, setup, neo(THETA), DRAW) for setup in (launch_setup, gives))
    there = launch(sling, launch_setup, neo(THETA), np.array(DRAW) + force[1:] / ARM)
    assert soft.landing_y == pytest.approx(there.landing_y, abs=2e-3)
    assert soft.hold_force == pytest.approx(there.hold_force, rel=1e-4)
    assert 0.005 < 1 - soft.landing_y[0] / firm.landing_y[0] < 0.02


def test_an_arm_that_the_band_pulls_along_fails_by_name_or_is_balanced(sling, launch_setup):
    """Over the whole box of θ, where some bands are stiffer than the arm."""
    weak = replace(launch_setup, arm_stiffness=500.0)
    thetas, draws = random_thetas(256, 3), random_draws(256, np.random.default_rng(3))
    done, firm = (launch(sling, setup, neo(thetas), draws) for setup in (weak, launch_setup))
    finite = np.isfinite(done.hold_force)
    assert all("converge" in done.failure[i] for i in np.flatnonzero(~finite))
    assert finite[firm.hold_force < 100].all() and not finite.all()
    along = draws / np.linalg.norm(draws, axis=1, keepdims=True)
    there = draws - along * np.nan_to_num(done.hold_force)[:, None] / weak.arm_stiffness
    balanced = launch(sling, launch_setup, neo(thetas), there).hold_force
    assert done.hold_force[finite] == pytest.approx(balanced[finite], rel=5e-3)
