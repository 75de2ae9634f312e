"""The objective is a method's loss, or one's own; fixed parameters are no axes."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real import Objective, Theta, simulate_batch
from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.settings.identification import MethodParams
from sling2sim2real.simulator.model import ClampedBand


def test_it_is_the_loss_of_the_method(world, episode) -> None:
    method = MethodParams(
        search="de",
        fixed={"poissons_ratio": 0.45, "elasticity_damping": 5e-3, "damping_scale": 1.0},
    )
    settings = world.settings.changed(methods={"by_two": method.model_dump()})
    world = replace(world, settings=settings)
    objective = Objective(world, [episode, episode], method="by_two")
    assert objective.names == ("youngs_modulus", "dynamic_friction")
    unit = np.array([[0.3, 0.5], [0.6, 0.9], [0.4, 0.7]])
    sling = ClampedBand.of(world.band, settings.setup, settings.sling, law=method.law)
    loss = EpisodeLoss.of(settings, "by_two", episode, sling)
    space = SearchBox.of_method(settings, "by_two")
    whole = [space.unit_of(objective.theta(point).parameters)[0] for point in unit]
    theirs = Evaluator(episode, sling, loss, space)(np.array(whole)).total
    assert np.allclose(objective(unit), 2 * theirs)


def test_theta_and_unit_cube_go_with_each_other(world, episode) -> None:
    objective = Objective(world, [episode], method="posterior")
    assert objective.theta(objective.unit(world.theta)).law == "rubber"
    back = objective.theta(objective.unit(world.theta))
    assert np.allclose(back.point, world.theta.point)
    assert objective.theta(np.ones(len(objective.names))).log_flow_rate == objective.high[-1]


def test_a_loss_of_ones_own(world, episode) -> None:
    def peak(simulated, recorded) -> float:
        return abs(float(simulated.force.max() - recorded.force.max()))

    objective = Objective(world, [episode], method="posterior", loss=peak)
    true = objective.unit(world.theta)
    softer = true - 0.05 * (np.arange(len(true)) == 0)
    here, there = objective(np.stack([true, softer]))
    assert here < 0.3 < there
    rollout = simulate_batch(world, episode, [objective.theta(softer)])[0]
    assert there == peak(rollout, episode)


def test_what_no_simulation_can_follow_is_infinite(world, episode) -> None:
    slippery = Theta(2.2e5, 0.47, 2.4e-3, 0.05, 0.6)
    for loss in (None, lambda simulated, recorded: 0.0):
        objective = Objective(world, [episode], loss=loss)
        assert np.isinf(objective(objective.unit(slippery)[None])).all()


@pytest.mark.parametrize(
    ("points", "message"),
    [(np.zeros(5), r"must have shape \(N, 5\)"), (np.full((1, 5), 1.5), "in the unit cube")],
)
def test_wrong_points(world, episode, points, message: str) -> None:
    with pytest.raises(UserError, match=message):
        Objective(world, [episode])(points)
