"""Train the slingshot policy with PPO (rsl_rl) on a response surface or on simulated launches.

The surface is the simulator read between simulated launches (landing_map.py), so what the policy
learns is the calibrated simulator's own landing in both cases. Training keeps the network whose
deterministic draws earn most over 256 targets spread over the trained range.
"""

from __future__ import annotations

import contextlib
import copy
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from rsl_rl.algorithms import PPO
from rsl_rl.utils import check_nan
from torch import nn

from sling2sim2real.base.machine import one_thread
from sling2sim2real.base.progress import Progress
from sling2sim2real.launching.surface.simulated import Source
from sling2sim2real.policy.environment import SlingshotVectorEnv, draw_box, rewarded
from sling2sim2real.policy.ppo import RslEnv, settings
from sling2sim2real.settings.launches import PolicyParams, Reward

CHECKED_TARGETS = 256


class Policy(nn.Module):
    """Target in metres to draw in metres; the normalisation of both is part of it.

    Attributes:
        projectile: Where it starts (y, z) [m], of a policy whose state is the paper's: the
            projectile's position, then the target. None: the target alone.
    """

    target_center: torch.Tensor
    target_half: torch.Tensor
    draw_center: torch.Tensor
    draw_half: torch.Tensor
    projectile: torch.Tensor | None

    def __init__(
        self,
        network: nn.Sequential,
        targets: tuple[float, float],
        surface: Source,
        projectile: tuple[float, float] | None = None,
    ) -> None:
        super().__init__()
        low, high = targets
        center, half = map(torch.from_numpy, draw_box(surface))
        self.network = network
        self.register_buffer("target_center", torch.tensor([(low + high) / 2]))
        self.register_buffer("target_half", torch.tensor([(high - low) / 2]))
        self.register_buffer("draw_center", center)
        self.register_buffer("draw_half", half)
        start = None if projectile is None else torch.tensor(projectile)
        self.register_buffer("projectile", start)

    def forward(self, target: torch.Tensor, projectile: torch.Tensor | None = None) -> torch.Tensor:
        """Draws (y, z) [m], shape (N, 2), for targets [m], (N, 1), and positions [m], (N, 2)."""
        seen = [(target - self.target_center) / self.target_half]
        if projectile is not None:
            seen.insert(0, (projectile - self.draw_center) / self.draw_half)
        return self.draw_center + self.draw_half * torch.tanh(self.network(torch.cat(seen, 1)))

    def draws(self, targets: np.ndarray) -> np.ndarray:
        """Draws (N, 2) [m] for targets (N,) [m], the projectile where it starts."""
        goals = torch.as_tensor(targets, dtype=torch.float32)[:, None]
        start = None if self.projectile is None else self.projectile.expand(len(goals), 2)
        with torch.inference_mode():
            return self(goals, start).double().numpy()


@dataclass(frozen=True)
class Trained:
    """A trained policy and how it came about.

    Attributes:
        policy: The network that earned most, in evaluation mode.
        curve: One row an iteration: iteration, mean_reward (of exploring launches), mean_error [m]
            (deterministic, over the checked targets; NaN if all fail), failed_targets
            (deterministic), failures (exploring launches that failed), learning_rate, std (of the
            exploration).
        iteration: The iteration that `policy` comes from.
        mean_error: Its error [m], as in the curve.
        failures: Exploring launches that failed, by reason, over the whole training.
    """

    policy: Policy
    curve: dict[str, list]
    iteration: int
    mean_error: float
    failures: dict[str, int]


def train(
    surface: Source,
    params: PolicyParams,
    progress: Progress | None = None,
    *,
    projectile: tuple[float, float] | None = None,
) -> Trained:
    """Train with the settings of `params` (the `policy:` section of params.yaml).

    Args:
        surface: Says where draws land: read off a map, or simulated.
        progress: Called for each iteration.
        projectile: Where it starts (y, z) [m], for a policy that sees it.

    Runs on one thread with seeded generators: the same input gives the same network, bit for bit,
    on one machine.

    Raises:
        ValueError: if the surface gives NaN for a draw that it does not call failed.
    """
    with one_thread():
        torch.manual_seed(params.seed)
        launches = SlingshotVectorEnv(
            surface,
            targets=params.targets,
            num_envs=params.envs,
            reward=params.reward,
            projectile=projectile,
        )
        env = RslEnv(launches, params.seed)
        with contextlib.redirect_stdout(io.StringIO()):  # it prints both networks
            configured = settings(params, env.groups)
            ppo = PPO.construct_algorithm(env.get_observations(), env, configured, "cpu")
        network: Any = ppo.get_policy()
        policy = Policy(network.mlp, params.targets, surface, projectile)
        checked = np.linspace(*params.targets, CHECKED_TARGETS)
        rows: list[dict] = []
        reasons: Counter[str] = Counter()
        best, chosen, weights = -np.inf, 0, {}
        for number, next_log_std in enumerate(_next_log_stds(params)):
            mean_reward = _iterate(ppo, env, params.steps)
            reasons.update(env.failures)
            worth, error, failed = earned(surface, policy.draws(checked), checked, params.reward)
            rows.append(
                {
                    "iteration": number + 1,
                    "mean_reward": mean_reward,
                    "mean_error": error,
                    "failed_targets": failed,
                    "failures": env.failures.total(),
                    "learning_rate": float(ppo.learning_rate),
                    "std": float(network.output_std.detach().mean()),
                }
            )
            env.failures.clear()
            if next_log_std is not None:
                with torch.no_grad():
                    network.distribution.log_std_param.fill_(next_log_std)
            if not weights or worth > best:
                best, chosen, weights = worth, number, copy.deepcopy(policy.state_dict())
            if progress:
                progress.advance(1, summary(error))
    policy.load_state_dict(weights)
    return Trained(
        policy=policy.eval(),
        curve={name: [row[name] for row in rows] for name in rows[0]},
        iteration=rows[chosen]["iteration"],
        mean_error=rows[chosen]["mean_error"],
        failures=dict(sorted(reasons.items())),
    )


def _iterate(ppo: PPO, env: RslEnv, steps: int) -> float:
    """Launch by the exploring policy and improve it; mean reward of the launches.

    The loop of rsl_rl's OnPolicyRunner, which logs the last 100 episodes only and has no place for
    what is done here after an iteration.
    """
    observed, rewards = env.get_observations(), []
    with torch.inference_mode():
        for _ in range(steps):
            observed, reward, done, extras = env.step(ppo.act(observed))
            check_nan(observed, reward, done)
            ppo.process_env_step(observed, reward, done, extras)
            rewards.append(float(reward.mean()))
        ppo.compute_returns(observed)
    ppo.update()
    return float(np.mean(rewards))


def _next_log_stds(params: PolicyParams) -> Sequence[float | None]:
    """Log of the exploration after each iteration; None: left to PPO.

    A scheduled exploration narrows geometrically from init_std to final_std: left to itself PPO
    narrows it so slowly that the mean still wanders by centimetres of landing at the end.
    """
    if params.exploration != "scheduled":
        return [None] * params.iterations
    start, end = np.log([params.init_std, params.final_std])
    schedule = np.linspace(start, end, params.iterations)
    return [*schedule[1:], schedule[-1]]


def earned(
    surface: Source, draws: np.ndarray, targets: np.ndarray, reward: Reward
) -> tuple[float, float, int]:
    """Mean reward and |y_p - g| [m] (NaN if all fail) of draws for targets, and failed targets."""
    rewards, launched = rewarded(surface, draws, targets, reward)
    error = np.abs(launched.landing_y - targets)
    failed = launched.failure > 0
    mean = float(error[~failed].mean()) if not failed.all() else float("nan")
    return float(rewards.mean()), mean, int(failed.sum())


def summary(error: float) -> str:
    """A mean error [m], NaN where every launch fails, as progress tells of it."""
    return "every launch fails" if np.isnan(error) else f"mean error {100 * error:.2f} cm"
