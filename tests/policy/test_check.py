"""What a policy is said to be worth: by launches, with failures counted and never averaged in."""

from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.launching.surface.landing_map import TOO_MUCH_FORCE
from sling2sim2real.policy.check import CONVERGED, PolicyCheck, check, figures, verdict
from tests.policy import toy


def params(max_force: float = 15.0) -> SimpleNamespace:
    return SimpleNamespace(
        policy=SimpleNamespace(targets=(1.425, 2.425)), setup=SimpleNamespace(max_force=max_force)
    )


TRAINED = SimpleNamespace(
    iteration=7, curve={"iteration": [1, 2]}, mean_error=0.002, failures={"it broke": 3}
)


def test_it_launches_the_draws_themselves(trained) -> None:
    targets = np.linspace(1.425, 2.425, 256)
    truth = np.abs(toy.launch(trained.policy.draws(targets)).landing_y - targets)
    result = check(trained.policy, toy.launch, params())
    assert result == PolicyCheck(pytest.approx(truth.mean()), pytest.approx(truth.max()), {})
    summary = figures(trained, result)
    assert summary["converged"] and summary["mean_error_m"] <= CONVERGED
    assert summary["map_mean_error_m"] == trained.mean_error != summary["mean_error_m"]
    assert verdict(summary, result.failures).startswith("converged, mean |y_p - g| 0.")
    assert figures(trained, result, "simulated")["map_mean_error_m"] is None


def test_a_launch_off_the_map_is_no_convergence(trained) -> None:
    """The simulator lands 3 cm further than the map had it."""

    def further(draws: np.ndarray):
        launched = toy.launch(draws)
        launched.landing_y = launched.landing_y + 0.03
        return launched

    result = check(trained.policy, further, params())
    summary = figures(trained, result)
    assert not summary["converged"] and summary["map_mean_error_m"] < CONVERGED
    assert summary["mean_error_m"] == pytest.approx(0.03, abs=0.005)
    assert verdict(summary, result.failures).startswith("NOT converged, mean |y_p - g| ")


def test_failures_are_counted_by_reason_and_forbid_convergence(trained) -> None:
    def broken(draws: np.ndarray):
        launched = toy.launch(draws)
        launched.failure = ["it broke"] * 5 + [None] * (len(draws) - 5)
        return launched

    weak = params(
        max_force=np.sort(toy.launch(trained.policy.draws(np.array([2.4]))).hold_force)[0]
    )
    result = check(trained.policy, broken, weak)
    assert result.failures["it broke"] == 5 and 1 <= result.failures[TOO_MUCH_FORCE] < 50
    summary = figures(trained, result)
    assert summary["failed_targets"] == sum(result.failures.values())
    assert summary["mean_error_m"] < CONVERGED and not summary["converged"]
    assert "it broke 5" in verdict(summary, result.failures)
