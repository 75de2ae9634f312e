"""The slingshot as a one-step decision problem, many launches at a time, for Gymnasium.

    observation  g             target displacement along y on the floor [m], uniform over a range;
                               where it is to be seen, also the projectile's position (y, z) [m]
    action a in [-1, 1]²       draw = centre of the box + half its size * a
    reward                     height * exp(-|y_p - g| / scale), or -penalty for a failed launch

Every step ends the episode, so discounting plays no part. Observed targets are normalised to
[-1, 1] over their range, positions as draws over their box.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from sling2sim2real.base.errors import UserError
from sling2sim2real.launching.surface.landing_map import Landings
from sling2sim2real.launching.surface.simulated import Source
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.settings.launches import Reward
from sling2sim2real.simulator.model import BandSizes
from sling2sim2real.simulator.parameters import Parameters


class SlingshotVectorEnv(VectorEnv):
    """One launch an episode, `num_envs` at a time; a step sets new targets."""

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}

    def __init__(
        self,
        surface: Source,
        *,
        targets: tuple[float, float],
        num_envs: int,
        reward: Reward,
        projectile: tuple[float, float] | None = None,
        error: float = 0.0,
        samples: Parameters | None = None,
    ) -> None:
        """Describe the problem.

        Args:
            surface: Says where draws land.
            targets: Range they are drawn from [m].
            reward: Its height, scale [m] and penalty (`policy.reward` of params.yaml).
            projectile: Where it starts (y, z) [m], if that is observed.
            error: Standard deviation of the drawn position along each axis [m]; the arm stays in
                the box.
            samples: Of θ, one of which each launch has; `surface` takes them beside draws.
        """
        self.surface, self.targets, self.num_envs = surface, targets, num_envs
        self.reward, self.error, self.samples = reward, error, samples
        self._box = center, half = draw_box(surface)
        self._seen = np.empty((num_envs, 0), np.float32)
        self.sees_projectile = projectile is not None
        if projectile is not None:
            self._seen = np.tile((np.array(projectile, np.float32) - center) / half, (num_envs, 1))
        limit = max(1.0, float(np.abs(self._seen).max(initial=0)))
        self.single_observation_space = Box(-limit, limit, (self._seen.shape[1] + 1,))
        self.single_action_space = Box(-1.0, 1.0, (2,))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.goal = np.full(num_envs, np.mean(targets), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict]:
        """New targets, or those of `options["target"]` [m], one or one an environment.

        Raises:
            UserError: A target lies outside the range, or they are too many or too few.
        """
        super().reset(seed=seed)
        low, high = self.targets
        goal = (options or {}).get("target")
        if goal is None:
            goal = self.np_random.uniform(low, high, self.num_envs)
        goal = np.atleast_1d(np.asarray(goal, np.float32))
        outside = (goal < low - 1e-5) | (goal > high + 1e-5) | np.isnan(goal)  # float32 targets
        if outside.any() or goal.shape not in {(1,), (self.num_envs,)}:
            raise UserError(
                f"target: must be 1 or {self.num_envs} numbers from {low:g} to {high:g} m, "
                f"got {goal.tolist()}"
            )
        self.goal = np.broadcast_to(goal, self.num_envs)
        return self._observed(), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
        """Launch, then set new targets; actions have shape (num_envs, 2).

        The last item tells of the launches, by shapes (N, 2), (N,), (N,) and (N,): `draw` [m],
        with its error; `landing` [m] and `hold_force` [N], NaN where there is none; `failure`, ""
        of a launch that lands. `final_obs` is what was seen before the new targets.
        """
        reward, draws, launched = self.launch(actions)
        all_end = np.ones(self.num_envs, bool)
        info = {
            "draw": draws,
            "landing": launched.landing_y,
            "hold_force": launched.hold_force,
            "failure": np.array(self.surface.reasons, object)[launched.failure],
            "final_obs": self._observed(),
            "_final_obs": all_end,
        }
        return self.reset()[0], reward, all_end, ~all_end, info

    def launch(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, Landings]:
        """Rewards, draws with their error [m] and landings of a step, whose targets stay."""
        center, half = self._box
        draws = center + half * np.clip(np.asarray(actions, np.float32), -1, 1)
        draws = draws.astype(float)
        if self.error:
            draws += self.error * self.np_random.standard_normal(draws.shape)
            draws = np.clip(draws, self.surface.low, self.surface.high)
        theta = ()
        if self.samples is not None:
            theta = (self.samples[self.np_random.integers(len(self.samples), size=len(draws))],)
        reward, launched = rewarded(
            self.surface, draws, self.goal.astype(float), self.reward, *theta
        )
        return reward, draws, launched

    def _observed(self) -> np.ndarray:
        low, high = self.targets
        target = (2 * self.goal - (low + high)) / (high - low)
        return np.column_stack([self._seen, np.clip(target, -1, 1)])


def rewarded(
    surface: Source, draws: np.ndarray, targets: np.ndarray, reward: Reward, *theta: Parameters
) -> tuple[np.ndarray, Landings]:
    """Rewards, shape (N,), and landings of draws (N, 2) [m] for targets (N,) [m]."""
    launched = surface(draws, *theta)
    hit = reward.height * np.exp(-np.abs(launched.landing_y - targets) / reward.scale)
    return np.where(launched.failure > 0, -reward.penalty, hit), launched


def draw_box(surface: Source) -> tuple[np.ndarray, np.ndarray]:
    """Centre and half size of the box of draws [m], each of shape (2,), float32."""
    low, high = (np.asarray(end, np.float32) for end in (surface.low, surface.high))
    return (low + high) / 2, (high - low) / 2


def projectile_start(setup: SetupParams, band: BandSizes) -> tuple[float, float]:
    """Where the projectile is before the hand draws it (y, z) [m]: in the slack band's middle.

    Each half of the band hangs straight from its tip.
    """
    return 0.0, -math.sqrt(band.rest_length**2 - setup.fork_width**2) / 2
