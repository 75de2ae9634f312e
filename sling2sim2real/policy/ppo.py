"""What rsl_rl needs for PPO: the environment in its interface, and its settings."""

from __future__ import annotations

from collections import Counter

import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from sling2sim2real.policy.environment import SlingshotVectorEnv
from sling2sim2real.settings.launches import PolicyParams


class RslEnv(VecEnv):
    """Launches of a Gymnasium environment, in the interface of rsl_rl.

    Actions are unbounded: tanh brings them into [-1, 1].

    Attributes:
        groups: Of observations, in the order in which a network sees them.
        failures: How often each reason of failure has occurred.
    """

    num_actions = 2
    max_episode_length = 1

    def __init__(self, launches: SlingshotVectorEnv, seed: int) -> None:
        self.launches, self.num_envs = launches, launches.num_envs
        self.device, self.cfg = "cpu", {}
        self.episode_length_buf = torch.zeros(self.num_envs, dtype=torch.long)
        self.failures: Counter[str] = Counter()
        self._random = torch.Generator().manual_seed(seed)
        self.groups = ["projectile", "target"] if launches.sees_projectile else ["target"]
        self._seen = self._reset()

    def get_observations(self) -> TensorDict:
        """Normalised, by group: "target", shape (num_envs, 1), and maybe "projectile", (.., 2)."""
        seen = {"projectile": self._seen[:, :-1], "target": self._seen[:, -1:]}
        groups = {name: seen[name] for name in self.groups}
        return TensorDict(groups, batch_size=[self.num_envs])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Launch, then set new targets. Actions have shape (num_envs, 2); every episode ends."""
        reward, _, launched = self.launches.launch(torch.tanh(actions).numpy())
        reasons = self.launches.surface.reasons
        self.failures.update(reasons[code] for code in launched.failure[launched.failure > 0])
        self._seen = self._reset()
        # No "time_outs": they would bootstrap a value into a problem that has no next state.
        reward = torch.from_numpy(reward).float()
        return self.get_observations(), reward, torch.ones(self.num_envs), {}

    def _reset(self) -> torch.Tensor:
        """What is seen with new targets, which torch draws: a seed gives the same ever since."""
        low, high = self.launches.targets
        goal = low + (high - low) * torch.rand(self.num_envs, generator=self._random)
        return torch.from_numpy(self.launches.reset(options={"target": goal.numpy()})[0])


def settings(params: PolicyParams, state: list[str]) -> dict:
    """Configuration of rsl_rl's algorithm.

    Args:
        params: The `policy:` section of params.yaml.
        state: Groups of observations that both networks see, in order.
    """
    network = {"class_name": "MLPModel", "hidden_dims": list(params.hidden), "activation": "elu"}
    exploration = {"class_name": "GaussianDistribution", "init_std": params.init_std}
    if params.exploration == "scheduled":  # else rsl_rl's default: one more parameter to learn
        exploration |= {"std_type": "log", "learn_std": False}
    return {
        "num_steps_per_env": params.steps,
        "multi_gpu": None,
        "obs_groups": {"actor": state, "critic": state},
        "actor": {**network, "distribution_cfg": exploration},
        "critic": dict(network),
        "algorithm": {
            "class_name": "PPO",
            "learning_rate": params.learning_rate,
            "gamma": 0.0,  # one step: the return is the reward
            "lam": 0.0,
            "entropy_coef": 0.0,
            "num_learning_epochs": 5,
            "num_mini_batches": 2,
            "schedule": "adaptive",
            "desired_kl": 0.01,
        },
    }
