"""The second policy: it knows what the identification leaves open, and that no draw is exact.

Many draws hit the same target. Among them it prefers those whose landing depends least on θ and on
the exact draw: its reward is expected over samples of θ's posterior, each with a landing map of its
own, and over `trials.actuation_error` in the drawn position. What there is to gain is small beside
what exploration costs: PPO's gradient drowns in it (docs/policy.md has the figures). So the plain
policy, which hits already, is refined by the expected reward's own gradient.
"""

from __future__ import annotations

import copy

import numpy as np
import torch

from pipeline.base.progress import Progress
from pipeline.landing.landing_map import LandingMap, Launcher
from pipeline.landing.response_surface import ResponseSurface
from pipeline.policy.environment import rewarded
from pipeline.policy.train import CHECKED_TARGETS, Policy, Trained, earned, one_thread, told

STEPS = 1000  # of the refinement
STEP = 2e-4  # m, of the differences along the draw: small against the grid
STEEPEST = 3.0  # medians: no target's gradient counts more


def refine(
    plain: Policy, surface: ResponseSurface, params, progress: Progress | None = None
) -> Trained:
    """Ascend the mean expected reward over the checked targets from a policy that hits.

    Adam, its rate a half sine of height `params.learning_rate`. The gradient along the draw is the
    surface's, by central differences; back-propagation takes it to the weights.

    Args:
        params: The `policy:` section of params.yaml.
        progress: Is told of each of `STEPS` steps.
    """
    policy = copy.deepcopy(plain).train()
    targets = np.linspace(*params.targets, CHECKED_TARGETS)
    inputs = torch.as_tensor(targets, dtype=torch.float32)[:, None]
    slope = _Slope(surface, targets, params.reward, plain.draws(targets))
    rates = params.learning_rate * np.sin(np.pi * (np.arange(STEPS) + 0.5) / STEPS)
    optimizer = torch.optim.Adam(policy.network.parameters())
    rows, best = [], 0
    with one_thread():
        for step, rate in enumerate(rates.tolist()):
            draws = policy(inputs)
            at = draws.detach().double().numpy()
            rows.append((step, *earned(surface, at, targets, params.reward), rate))
            if step == 0 or rows[step][1] > rows[best][1]:
                best, weights = step, copy.deepcopy(policy.state_dict())
            optimizer.param_groups[0]["lr"] = rate
            optimizer.zero_grad()
            (-(torch.from_numpy(slope(at)).float() * draws).sum(1).mean()).backward()
            optimizer.step()
            if progress:
                progress.advance(1, told(rows[step][2]))
    policy.load_state_dict(weights)
    names = ("iteration", "mean_reward", "mean_error", "failed_targets", "learning_rate")
    curve = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    return Trained(policy.eval(), curve, best, curve["mean_error"][best], failures={})


class _Slope:
    """Gradient of the expected reward along draws for fixed targets."""

    def __init__(self, surface: ResponseSurface, targets: np.ndarray, reward, home: np.ndarray):
        """Know the plain draws `home`: a draw that fails more often is pulled back to its own."""
        self.surface, self.targets, self.reward, self.home = surface, targets, reward, home
        self.usual = (surface(home).failure > 0).mean(1)

    def __call__(self, draws: np.ndarray) -> np.ndarray:
        """[1/m], shape (N, 2), within the box."""
        shifts = STEP * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
        points = np.clip(draws[:, None] + shifts, self.surface.low, self.surface.high)
        targets = np.repeat(self.targets, 4)
        rewards, launched = rewarded(self.surface, points.reshape(-1, 2), targets, self.reward)
        rewards = rewards.reshape(-1, 4)
        ways = np.abs(points[:, :2] - points[:, 2:]).sum(2)
        gradient = (rewards[:, :2] - rewards[:, 2:]) / ways
        steep = np.linalg.norm(gradient, axis=1, keepdims=True)
        limit = STEEPEST * np.median(steep)
        gradient *= np.minimum(1, limit / np.maximum(steep, 1e-12))
        fails = (launched.failure > 0).mean(1).reshape(-1, 4).max(1) > self.usual
        back = self.home - draws
        back *= limit / np.maximum(np.linalg.norm(back, axis=1, keepdims=True), 1e-12)
        return np.where(fails[:, None], back, gradient)


def robust_maps(
    launcher: Launcher, samples: np.ndarray, draw: np.ndarray, params
) -> list[LandingMap]:
    """Landing maps of `policy.robust.samples` of the posterior's samples, shape (M, P).

    Args:
        launcher: `launcher(draws, thetas)` launches each draw with a θ of its own.
        draw: Where the samples are compared, shape (2,) [m].
        params: The whole of params.yaml.
    """
    return LandingMap.simulate_each(
        launcher,
        representative(launcher, samples, draw, params.policy.robust.samples),
        draw_y=params.setup.draw_y,
        draw_z=params.setup.draw_z,
        size=params.policy.robust.map_size,
        max_force=params.setup.max_force,
        seed=params.policy.seed,
    )


def representative(
    launcher: Launcher, samples: np.ndarray, draw: np.ndarray, count: int
) -> np.ndarray:
    """`count` of the samples, all where there are no more: the middles of equal shares of them,
    ordered by their landing from `draw`.

    So few then have the posterior's own median and spread. As many random ones would move every
    landing by a chance of spread / sqrt(count), and the policy's aim with it.
    """
    if len(samples) <= count:
        return samples
    launched = launcher(np.tile(draw, (len(samples), 1)), samples)
    good = np.array([reason is None for reason in launched.failure])
    order = np.argsort(np.where(good, launched.landing_y, np.inf), kind="stable")
    middles = (np.arange(count) + 0.5) * len(samples) / count
    return samples[order[middles.astype(int)]]
