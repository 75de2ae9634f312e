"""The environment's contract: one step, the paper's reward, failures penalised and counted."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from sling2sim2real.launching.surface.response_surface import TOO_MUCH_FORCE, ResponseSurface
from sling2sim2real.policy.environment import SlingshotEnv, projectile_start
from tests.policy import toy

TARGETS = (1.425, 2.425)
REWARD = SimpleNamespace(height=5.0, scale=0.5, penalty=1.0)


@pytest.fixture
def env(toy_map) -> SlingshotEnv:
    return make(toy_map.surface)


def make(surface: ResponseSurface, **changes) -> SlingshotEnv:
    usual = {"num_envs": 400, "seed": 7}
    return SlingshotEnv(surface, targets=TARGETS, **{"reward": REWARD, **usual, **changes})


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
    retained = first.clone()
    assert (env.get_observations()["target"] == first).all()
    second, *_ = env.step(torch.zeros(400, 2))
    assert first.shape == (400, 1) and (first == retained).all()
    assert not (second["target"] == first).any()
    for observed in (first, second["target"]):
        assert -1 <= observed.min() < -0.97 and 0.97 < observed.max() <= 1
        assert abs(observed.mean()) < 0.1


def test_the_projectile_is_seen_where_it_starts(toy_map, env) -> None:
    """In half boxes of draws, beside the same targets; the same in every step."""
    seeing = make(toy_map.surface, projectile=(-0.25, -0.30))
    assert (env.groups, seeing.groups) == (["target"], ["projectile", "target"])
    first = seeing.get_observations()
    second, *_ = seeing.step(torch.zeros(400, 2))
    for seen in (first, second):
        np.testing.assert_allclose(seen["projectile"], [[1.0, -1.0]] * 400, atol=1e-5)
    assert (first["target"] == env.get_observations()["target"]).all()


def test_a_projectile_hangs_as_far_from_the_tips_as_half_the_band() -> None:
    setup, band = SimpleNamespace(fork_width=0.275), SimpleNamespace(rest_length=0.52)
    y, z = projectile_start(setup, band)
    assert y == 0 and z < 0 and np.hypot(z, 0.275 / 2) == pytest.approx(0.26)
