"""Train the slingshot policy with PPO (rsl_rl) on a landing map.

The landing map is the simulator read between simulated launches (landing_map.py), so what the
policy learns is the calibrated simulator's own landing. Training keeps the network whose
deterministic draws land nearest to 256 targets spread over the trained range.
"""

from __future__ import annotations

import contextlib
import copy
import io
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from pipeline.policy.environment import SlingshotEnv, draw_box
from pipeline.policy.landing_map import LandingMap

CONVERGED = 0.01  # mean |y_p - g| [m] over the checked targets that counts as converged
CHECKED_TARGETS = 256


class Policy(nn.Module):
    """Target in metres to draw in metres; the normalisation of both is part of it."""

    def __init__(self, network: nn.Module, targets: tuple[float, float], landing_map: LandingMap):
        super().__init__()
        low, high = targets
        center, half = draw_box(landing_map)
        self.network = network
        self.register_buffer("target_center", torch.tensor([(low + high) / 2]))
        self.register_buffer("target_half", torch.tensor([(high - low) / 2]))
        self.register_buffer("draw_center", center)
        self.register_buffer("draw_half", half)

    def forward(self, target: torch.Tensor) -> torch.Tensor:
        """Draws (y, z) [m], shape (N, 2), for targets [m], shape (N, 1)."""
        action = self.network((target - self.target_center) / self.target_half)
        return self.draw_center + self.draw_half * torch.tanh(action)


@dataclass(frozen=True)
class Trained:
    """A trained policy and how it came about.

    Attributes:
        policy: The network with the smallest error, in evaluation mode.
        curve: One row an iteration: iteration, mean_reward, mean_error [m] (deterministic, over
            the checked targets; NaN if all fail), failed_targets (deterministic), failures
            (exploring launches that failed), learning_rate, std (of the exploration).
        iteration: The iteration that `policy` comes from.
        mean_error, max_error: Deterministic |y_p - g| [m] over the checked targets.
        failed_targets: Checked targets whose launch fails.
        failures: Exploring launches that failed, by reason, over the whole training.
    """

    policy: Policy
    curve: dict[str, list]
    iteration: int
    mean_error: float
    max_error: float
    failed_targets: int
    failures: dict[str, int]

    @property
    def converged(self) -> bool:
        return self.failed_targets == 0 and self.mean_error <= CONVERGED


def train(landing_map: LandingMap, params) -> Trained:
    """Train with the settings of `params` (the `policy:` section of params.yaml).

    Runs on one thread with seeded generators: the same input gives the same network, bit for bit,
    on one machine.
    """
    from rsl_rl.runners import OnPolicyRunner

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        torch.manual_seed(params.seed)
        np.random.seed(params.seed)
        env = SlingshotEnv(
            landing_map,
            targets=tuple(params.targets),
            num_envs=params.envs,
            height=params.reward.height,
            scale=params.reward.scale,
            penalty=params.reward.penalty,
            seed=params.seed,
        )
        with contextlib.redirect_stdout(io.StringIO()):  # it prints both networks
            runner = OnPolicyRunner(env, _runner_config(params), log_dir=None, device="cpu")
        log_std = np.linspace(*np.log([params.init_std, params.final_std]), params.iterations)
        curve = _Curve(runner, env, log_std)
        runner.logger = curve
        runner.learn(params.iterations)  # once: a second call would start from stale observations
    finally:
        torch.set_num_threads(threads)
    return curve.result()


def evaluate(policy: Policy, landing_map: LandingMap, targets: np.ndarray) -> np.ndarray:
    """|y_p - g| [m] of the deterministic draws for targets [m], NaN where failed, shape (N,)."""
    with torch.inference_mode():
        draws = policy(torch.as_tensor(targets, dtype=torch.float32)[:, None])
    return np.abs(landing_map(draws.double().numpy()).landing_y - targets)


class _Curve:
    """Stands where rsl_rl has its logger: checks the policy after every iteration, keeps the best.

    rsl_rl's own mean reward covers the last 100 episodes only, and its log folder copies git diffs.
    The exploration also narrows here, geometrically from init_std to final_std: left to itself
    PPO narrows it so slowly that the mean still wanders by centimetres of landing at the end.
    """

    writer = None
    log_dir = None

    def __init__(self, runner, env: SlingshotEnv, log_std: np.ndarray):
        self.env = env
        self.log_std = log_std  # exploration after each iteration, shape (iterations,)
        network = runner.alg.get_policy()
        self.distribution = network.distribution
        self.policy = Policy(network.mlp, env.targets, env.landing_map)
        self.checked = np.linspace(*env.targets, CHECKED_TARGETS)
        self.rewards: list[float] = []
        self.rows: list[dict] = []
        self.reasons: dict[str, int] = {}
        self.best: tuple | None = None

    def init_logging_writer(self) -> None:
        """Nothing to open."""

    def process_env_step(self, rewards: torch.Tensor, dones, extras, intrinsic) -> None:
        self.rewards.append(float(rewards.mean()))

    def log(self, it: int, learning_rate: float, action_std: torch.Tensor, **_) -> None:
        error = evaluate(self.policy, self.env.landing_map, self.checked)
        failed = int(np.isnan(error).sum())
        mean = float(np.nanmean(error)) if failed < len(error) else float("nan")
        reasons = self.env.take_failures()
        for reason, count in reasons.items():
            self.reasons[reason] = self.reasons.get(reason, 0) + count
        self.rows.append(
            {
                "iteration": it + 1,
                "mean_reward": float(np.mean(self.rewards)),
                "mean_error": mean,
                "failed_targets": failed,
                "failures": sum(reasons.values()),
                "learning_rate": learning_rate,
                "std": float(action_std.detach().mean()),
            }
        )
        with torch.no_grad():
            self.distribution.log_std_param.fill_(self.log_std[it])
        self.rewards.clear()
        quality = (failed, mean if failed < len(error) else float("inf"))
        if self.best is None or quality < self.best[0]:
            maximum = float(np.nanmax(error)) if failed < len(error) else float("nan")
            self.best = (quality, it + 1, mean, maximum, copy.deepcopy(self.policy))

    def result(self) -> Trained:
        (failed, _), iteration, mean, maximum, policy = self.best
        return Trained(
            policy=policy.eval(),
            curve={name: [row[name] for row in self.rows] for name in self.rows[0]},
            iteration=iteration,
            mean_error=mean,
            max_error=maximum,
            failed_targets=failed,
            failures=dict(sorted(self.reasons.items())),
        )


def _runner_config(params) -> dict:
    network = {"class_name": "MLPModel", "hidden_dims": list(params.hidden), "activation": "elu"}
    exploration = {
        "class_name": "GaussianDistribution",
        "init_std": params.init_std,
        "std_type": "log",
        "learn_std": False,
    }
    return {
        "num_steps_per_env": params.steps,
        "save_interval": params.iterations,
        "obs_groups": {"actor": ["target"], "critic": ["target"]},
        "actor": {**network, "distribution_cfg": exploration},
        "critic": dict(network),
        "algorithm": {
            "class_name": "PPO",
            "learning_rate": params.learning_rate,
            "gamma": 0.0,  # one step: the return is the reward
            "lam": 0.0,
            "entropy_coef": 0.0,
            "num_learning_epochs": 5,
            "num_mini_batches": 4,
            "schedule": "adaptive",
            "desired_kl": 0.01,
        },
    }
