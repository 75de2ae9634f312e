"""What a trained policy is worth, by launches in the calibrated simulator and not by a map."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from sling2sim2real.launching.surface.landing_map import TOO_MUCH_FORCE, Launcher
from sling2sim2real.policy.train import CHECKED_TARGETS, Policy, Trained
from sling2sim2real.settings import Settings

CONVERGED = 0.01  # mean |y_p - g| [m] over the checked targets that counts as converged
CRITERION = (
    f"mean |y_p - g| <= {CONVERGED:g} m over {CHECKED_TARGETS} targets launched in the calibrated"
    " simulator, no failure"
)


@dataclass(frozen=True)
class PolicyCheck:
    """Launches of a policy's draws.

    Attributes:
        mean_error, max_error: |y_p - g| [m] of those that land; NaN where none does.
        failures: How many fail, by reason.
    """

    mean_error: float
    max_error: float
    failures: dict[str, int]


def check(policy: Policy, launcher: Launcher, params: Settings) -> PolicyCheck:
    """Launch the policy's draws for targets spread over the trained range, as they are.

    Args:
        params: The whole of params.yaml.
    """
    targets = np.linspace(*params.policy.targets, CHECKED_TARGETS)
    launched = launcher(policy.draws(targets))
    heavy = np.asarray(launched.hold_force) > params.setup.max_force
    pairs = zip(launched.failure, heavy, strict=True)
    reasons = [reason or (TOO_MUCH_FORCE if much else None) for reason, much in pairs]
    landed = np.array([reason is None for reason in reasons])
    error = np.abs(np.asarray(launched.landing_y)[landed] - targets[landed])
    failures = Counter(reason for reason in reasons if reason)
    nan = float("nan")
    return PolicyCheck(
        mean_error=float(error.mean()) if len(error) else nan,
        max_error=float(error.max()) if len(error) else nan,
        failures=dict(sorted(failures.items())),
    )


def figures(trained: Trained, checked: PolicyCheck, landings: str = "map") -> dict:
    """What a card tells of a training; errors are |y_p - g| of the deterministic policy [m].

    Args:
        landings: What it was trained on (`policy.landings` of params.yaml).
    """
    by_map = trained.mean_error if landings == "map" else None
    return {
        "converged": not checked.failures and checked.mean_error <= CONVERGED,
        "criterion": CRITERION,
        "iteration": trained.iteration,  # that the policy comes from
        "iterations": len(trained.curve["iteration"]),
        "mean_error_m": checked.mean_error,  # launched in the calibrated simulator
        "max_error_m": checked.max_error,
        "failed_targets": sum(checked.failures.values()),
        "map_mean_error_m": by_map,  # the same by the interpolated landing map
        "failed_launches": trained.failures,  # exploring ones, by reason
    }


def verdict(training: dict, failures: dict[str, int]) -> str:
    """A line about a training's figures: whether it converged, and what stood in the way."""
    state = "converged" if training["converged"] else "NOT converged"
    mean = training["mean_error_m"]
    text = f"{state}, mean |y_p - g| {100 * mean:.2f} cm" if mean == mean else state
    if failures:
        reasons = ", ".join(f"{reason} {count}" for reason, count in failures.items())
        text += f"; {training['failed_targets']} of {CHECKED_TARGETS} targets fail: {reasons}"
    return text
