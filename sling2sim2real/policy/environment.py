"""The slingshot as a one-step decision problem, batched, in the interface of rsl_rl.

    state  g           target displacement along y on the floor [m], uniform over a range;
                       where the policy is to see it, also the projectile's position (y, z) [m]
    action a in R²     draw = centre of the box + half its size * tanh(a)
    reward             height * exp(-|y_p - g| / scale), or -penalty for a failed launch

Every step ends the episode, so discounting plays no part. Observed targets are normalised to
[-1, 1] over their range, positions as draws over their box.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from sling2sim2real.launching.surface.response_surface import Landings
from sling2sim2real.launching.surface.simulated import Source
from sling2sim2real.settings.lab import BandParams, SetupParams
from sling2sim2real.settings.launches import Reward


class SlingshotEnv(VecEnv):
    """One launch an episode, `num_envs` at a time.

    Attributes:
        groups: Of observations, in the order in which a network sees them.
        failures: How often each reason of failure has occurred since the last `take_failures`.
    """

    num_actions = 2
    max_episode_length = 1

    def __init__(
        self,
        surface: Source,
        *,
        targets: tuple[float, float],
        num_envs: int,
        reward: Reward,
        seed: int,
        projectile: tuple[float, float] | None = None,
    ) -> None:
        """Set targets.

        Args:
            targets: Range they are drawn from [m].
            reward: Its height, scale [m] and penalty (`policy.reward` of params.yaml).
            projectile: Where it starts (y, z) [m], if that is observed.
        """
        self.surface = surface
        self.targets = targets
        self.num_envs = num_envs
        self.reward = reward
        self.device = "cpu"
        self.cfg = {}
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long)
        self.failures: Counter[str] = Counter()
        self._random = torch.Generator().manual_seed(seed)
        self._box = center, half = draw_box(surface)
        self._fixed: dict[str, torch.Tensor] = {}
        if projectile is not None:
            position = ((torch.tensor(projectile) - center) / half).expand(num_envs, 2)
            self._fixed["projectile"] = position
        self.groups = [*self._fixed, "target"]
        self._goal = self._new_goals()

    def get_observations(self) -> TensorDict:
        """Normalised, by group: "target", shape (num_envs, 1), and maybe "projectile", (.., 2)."""
        low, high = self.targets
        target = (2 * self._goal - (low + high)) / (high - low)
        seen = {**self._fixed, "target": target[:, None]}
        return TensorDict(seen, batch_size=[self.num_envs])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Launch, then set new targets. Actions have shape (num_envs, 2); every episode ends."""
        center, half = self._box
        draws = center + half * torch.tanh(actions)
        goal = self._goal.double().numpy()
        reward, launched = rewarded(self.surface, draws.double().numpy(), goal, self.reward)
        codes, counts = np.unique(launched.failure, return_counts=True)
        for code, count in zip(codes.tolist(), counts.tolist(), strict=True):
            if code:
                self.failures[self.surface.reasons[code]] += count
        self._goal = self._new_goals()
        # No "time_outs": they would bootstrap a value into a problem that has no next state.
        reward = torch.from_numpy(reward).float()
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


def rewarded(
    surface: Source, draws: np.ndarray, targets: np.ndarray, reward: Reward
) -> tuple[np.ndarray, Landings]:
    """Rewards, shape (N,), and landings of draws (N, 2) [m] for targets (N,) [m]."""
    launched = surface(draws)
    hit = reward.height * np.exp(-np.abs(launched.landing_y - targets) / reward.scale)
    return np.where(launched.failure > 0, -reward.penalty, hit), launched


def draw_box(surface: Source) -> tuple[torch.Tensor, torch.Tensor]:
    """Centre and half size of the box of draws [m], each of shape (2,)."""
    low, high = (torch.tensor(end, dtype=torch.float32) for end in (surface.low, surface.high))
    return (low + high) / 2, (high - low) / 2


def projectile_start(setup: SetupParams, band: BandParams) -> tuple[float, float]:
    """Where the projectile is before the hand draws it (y, z) [m]: in the slack band's middle.

    Each half of the band hangs straight from its tip.

    Args:
        setup, band: `setup` and the band's section of params.yaml.
    """
    return 0.0, -math.sqrt(band.rest_length**2 - setup.fork_width**2) / 2
