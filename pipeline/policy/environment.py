"""The slingshot as a one-step decision problem, batched, in the interface of rsl_rl.

    state  g           target displacement along y on the floor [m], uniform over a range
    action a in R²     draw = centre of the box + half its size * tanh(a)
    reward             height * exp(-|y_p - g| / scale), or -penalty for a failed launch

Every step ends the episode, so discounting plays no part. Observations are normalised to [-1, 1]
over the range of targets.
"""

from __future__ import annotations

from collections import Counter

import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from pipeline.policy.landing_map import LandingMap


class SlingshotEnv(VecEnv):
    """One launch an episode, `num_envs` at a time.

    Attributes:
        failures: How often each reason of failure has occurred since the last `take_failures`.
    """

    num_actions = 2
    max_episode_length = 1

    def __init__(
        self,
        landing_map: LandingMap,
        *,
        targets: tuple[float, float],
        num_envs: int,
        height: float,
        scale: float,
        penalty: float,
        seed: int,
    ):
        self.landing_map = landing_map
        self.targets = targets
        self.num_envs = num_envs
        self.height, self.scale, self.penalty = height, scale, penalty
        self.device = "cpu"
        self.cfg = {}
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long)
        self.failures: Counter[str] = Counter()
        self._random = torch.Generator().manual_seed(seed)
        self._box = draw_box(landing_map)
        self._goal = self._new_goals()

    def get_observations(self) -> TensorDict:
        """Normalised targets, group "target", shape (num_envs, 1)."""
        low, high = self.targets
        target = (2 * self._goal - (low + high)) / (high - low)
        return TensorDict({"target": target[:, None]}, batch_size=[self.num_envs])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Launch, then set new targets. Actions have shape (num_envs, 2); every episode ends."""
        center, half = self._box
        draws = center + half * torch.tanh(actions)
        launched = self.landing_map(draws.double().numpy())
        landing = torch.from_numpy(launched.landing_y).float()
        failed = torch.from_numpy(launched.failure > 0)
        hit = self.height * torch.exp(-(landing - self._goal).abs() / self.scale)
        reward = torch.where(failed, torch.full_like(hit, -self.penalty), hit)
        reasons = self.landing_map.reasons
        self.failures.update(reasons[code] for code in launched.failure if code)
        self._goal = self._new_goals()
        # No "time_outs": they would bootstrap a value into a problem that has no next state.
        return self.get_observations(), reward, torch.ones(self.num_envs), {}

    def take_failures(self) -> dict[str, int]:
        """Counts of failures by reason since the last call."""
        counted = dict(sorted(self.failures.items()))
        self.failures.clear()
        return counted

    def _new_goals(self) -> torch.Tensor:
        low, high = self.targets
        # A fresh tensor: rsl_rl keeps observations by reference until the step is stored.
        return low + (high - low) * torch.rand(self.num_envs, generator=self._random)


def draw_box(landing_map: LandingMap) -> tuple[torch.Tensor, torch.Tensor]:
    """Centre and half size of the box of draws [m], each of shape (2,)."""
    low = torch.tensor([landing_map.draw_y[0], landing_map.draw_z[0]], dtype=torch.float32)
    high = torch.tensor([landing_map.draw_y[-1], landing_map.draw_z[-1]], dtype=torch.float32)
    return (low + high) / 2, (high - low) / 2
