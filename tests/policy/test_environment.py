"""The environment's contract: one step, the paper's reward, failures penalised and told."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from sling2sim2real import UserError
from sling2sim2real.launching.surface.landing_map import TOO_MUCH_FORCE, LandingMap
from sling2sim2real.launching.surface.simulated import SimulatedLandings
from sling2sim2real.policy.environment import SlingshotVectorEnv, projectile_start
from sling2sim2real.policy.ppo import RslEnv
from sling2sim2real.simulator.parameters import Parameters
from tests.policy import toy

TARGETS = (1.425, 2.425)
REWARD = SimpleNamespace(height=5.0, scale=0.5, penalty=1.0)
LOW, HIGH = np.array([toy.DRAW_Y, toy.DRAW_Z]).T


@pytest.fixture
def env(toy_map) -> SlingshotVectorEnv:
    return make(toy_map)


def make(surface: LandingMap | SimulatedLandings, **changes) -> SlingshotVectorEnv:
    usual = {"targets": TARGETS, "num_envs": 400, "reward": REWARD}
    return SlingshotVectorEnv(surface, **{**usual, **changes})


def targets_of(observed: np.ndarray) -> np.ndarray:
    return np.mean(TARGETS) + (TARGETS[1] - TARGETS[0]) / 2 * observed[:, -1].astype(float)


def test_reward_is_the_papers(env) -> None:
    observed, _ = env.reset(seed=1)
    actions = np.random.default_rng(0).uniform(-1, 1, (400, 2))
    _, reward, ended, truncated, info = env.step(actions)
    draws = (LOW + HIGH) / 2 + (HIGH - LOW) / 2 * actions
    truth = toy.launch(draws)
    failed = truth.hold_force > 15.0
    expected = 5.0 * np.exp(-np.abs(truth.landing_y - targets_of(observed)) / 0.5)
    assert 20 < failed.sum() < 380
    np.testing.assert_allclose(reward, np.where(failed, -1.0, expected), atol=2e-3)
    assert ended.all() and not truncated.any()
    np.testing.assert_allclose(info["draw"], draws, atol=1e-6)
    np.testing.assert_allclose(info["landing"][~failed], truth.landing_y[~failed], atol=2e-4)
    assert np.isnan(info["landing"][failed]).all()
    assert (info["failure"] == np.where(failed, TOO_MUCH_FORCE, "")).all()
    assert (info["final_obs"] == observed).all()


def test_targets_cover_the_range_change_every_step_and_follow_the_seed(env) -> None:
    first, _ = env.reset(seed=7)
    second, *_ = env.step(np.zeros((400, 2)))
    assert first.shape == (400, 1) and not (second == first).any()
    for observed in (first, second):
        assert -1 <= observed.min() < -0.97 and 0.97 < observed.max() <= 1
        assert abs(observed.mean()) < 0.1
    assert (env.reset(seed=7)[0] == first).all() and not (env.reset(seed=8)[0] == first).any()
    assert env.reset(options={"target": 1.925})[0] == pytest.approx(0.0, abs=1e-6)
    for wrong in (2.6, [1.5, 1.6], np.nan):
        with pytest.raises(UserError, match=r"^target: must be 1 or 400 numbers from 1.425 to"):
            env.reset(options={"target": wrong})


def test_the_draw_has_its_error_within_the_box(toy_map) -> None:
    env = make(toy_map, error=1e-3)
    env.reset(seed=3)
    told = env.step(np.zeros((400, 2)))[-1]["draw"] - (LOW + HIGH) / 2
    assert told.std(axis=0) == pytest.approx([1e-3, 1e-3], rel=0.1)
    assert abs(told.mean(axis=0)).max() < 2e-4
    told = env.step(np.full((400, 2), 1.5))[-1]["draw"]
    assert (told.max(axis=0) == HIGH).all() and (told >= HIGH - 5e-3).all()


def test_each_launch_has_a_sample_of_its_own() -> None:
    """Its modulus goes into the landing, so that the landing tells which it was."""

    def launch(draws: np.ndarray, theta: Parameters) -> SimpleNamespace:
        landing = theta.values[:, 0] / 1e5
        return SimpleNamespace(landing_y=landing, hold_force=0 * landing, failure=[None] * 400)

    points = np.tile([1e5, 0.47, 2e-3, 0.5, 0.6, 0.0, 0.0, 0.0], (3, 1))
    points[:, 0] *= [1.0, 2.0, 3.0]
    setup = SimpleNamespace(draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, max_force=15.0)
    env = make(SimulatedLandings(launch, setup), samples=Parameters("neo_hookean", points))
    env.reset(seed=2)
    landed, counts = np.unique(env.step(np.zeros((400, 2)))[-1]["landing"], return_counts=True)
    assert landed == pytest.approx([1.0, 2.0, 3.0]) and counts.min() > 100


def test_rsl_rl_sees_the_same_launches(toy_map) -> None:
    """With the projectile in half boxes of draws before the target, as a group of its own."""
    blind = RslEnv(make(toy_map), seed=7)
    seeing = RslEnv(make(toy_map, projectile=(-0.25, -0.30)), seed=7)
    assert (blind.groups, seeing.groups) == (["target"], ["projectile", "target"])
    first = seeing.get_observations()
    retained = first["target"].clone()
    assert (retained == blind.get_observations()["target"]).all()
    actions = torch.randn(400, 2, generator=torch.Generator().manual_seed(0))
    second, reward, done, extras = seeing.step(actions)
    for seen in (first, second):
        np.testing.assert_allclose(seen["projectile"], [[1.0, -1.0]] * 400, atol=1e-5)
    assert (first["target"] == retained).all() and not (second["target"] == retained).any()
    assert reward.shape == done.shape == (400,) and (done == 1).all() and "time_outs" not in extras
    assert {**seeing.failures} == {TOO_MUCH_FORCE: int((reward == -1).sum())} != {TOO_MUCH_FORCE: 0}


def test_a_projectile_hangs_as_far_from_the_tips_as_half_the_band() -> None:
    setup, band = SimpleNamespace(fork_width=0.275), SimpleNamespace(rest_length=0.52)
    y, z = projectile_start(setup, band)
    assert y == 0 and z < 0 and np.hypot(z, 0.275 / 2) == pytest.approx(0.26)
