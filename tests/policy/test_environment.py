"""The environment's contract: one step, the paper's reward, failures penalised and counted."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from pipeline.policy.environment import SlingshotEnv
from pipeline.policy.landing_map import TOO_MUCH_FORCE
from tests.policy import toy

TARGETS = (1.425, 2.425)


@pytest.fixture
def env(toy_map) -> SlingshotEnv:
    return SlingshotEnv(
        toy_map, targets=TARGETS, num_envs=400, height=5.0, scale=0.5, penalty=1.0, seed=7
    )


def targets_of(observations) -> np.ndarray:
    low, high = TARGETS
    return (low + high) / 2 + (high - low) / 2 * observations["target"][:, 0].double().numpy()


def test_reward_is_the_papers(env) -> None:
    goals = targets_of(env.get_observations())
    actions = torch.randn(400, 2, generator=torch.Generator().manual_seed(0))
    _, reward, done, extras = env.step(actions)
    low, high = np.array([toy.DRAW_Y, toy.DRAW_Z]).T
    draws = (low + high) / 2 + (high - low) / 2 * np.tanh(actions.double().numpy())
    truth = toy.launch(draws)
    failed = truth.hold_force > 15.0
    expected = np.where(failed, -1.0, 5.0 * np.exp(-np.abs(truth.landing_y - goals) / 0.5))
    assert 20 < failed.sum() < 380
    np.testing.assert_allclose(reward.numpy(), expected, atol=2e-3)
    assert (done == 1).all() and "time_outs" not in extras
    assert env.take_failures() == {TOO_MUCH_FORCE: int(failed.sum())}
    assert env.take_failures() == {}


def test_targets_cover_the_range_and_change_every_step(env) -> None:
    first = env.get_observations()["target"]
    kept = first.clone()
    second, *_ = env.step(torch.zeros(400, 2))
    assert first.shape == (400, 1) and (first == kept).all()
    assert not (second["target"] == first).any()
    for observed in (first, second["target"]):
        assert -1 <= observed.min() < -0.97 and 0.97 < observed.max() <= 1
        assert abs(observed.mean()) < 0.1


def test_asking_twice_observes_the_same(env) -> None:
    assert (env.get_observations()["target"] == env.get_observations()["target"]).all()


def test_equal_seeds_give_equal_targets(toy_map, env) -> None:
    options = {"targets": TARGETS, "num_envs": 400, "height": 5.0, "scale": 0.5, "penalty": 1.0}
    twin = SlingshotEnv(toy_map, seed=7, **options)
    other = SlingshotEnv(toy_map, seed=8, **options)
    assert (twin.get_observations()["target"] == env.get_observations()["target"]).all()
    assert (other.get_observations()["target"] != env.get_observations()["target"]).any()
