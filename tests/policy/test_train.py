"""Training on the toy slingshot, whose landing is known in closed form."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from sling2sim2real.launching.surface.landing_map import TOO_MUCH_FORCE
from sling2sim2real.launching.surface.simulated import SimulatedLandings
from sling2sim2real.policy.train import Trained, train
from tests.policy import toy

CHANGES = {
    "seed": 2,
    "targets": (1.5, 2.0),
    "envs": 128,
    "steps": 2,
    "iterations": 3,
    "hidden": (32, 16),
    "learning_rate": 1e-4,
    "init_std": 0.3,
    "final_std": 0.1,
    "exploration": "learned",
}
REWARD = {"height": 2.0, "scale": 0.2, "penalty": 3.0}


def test_the_policy_hits_the_closed_form_within_a_centimetre(trained) -> None:
    assert error_of(trained) <= 0.01
    np.testing.assert_allclose(trained.mean_error, error_of(trained), atol=1e-4)


def short(settings, **changes) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(settings), "iterations": 2, "envs": 64, **changes})


def same(first: Trained, second: Trained) -> bool:
    pairs = zip(first.policy.parameters(), second.policy.parameters(), strict=True)
    return first.curve == second.curve and all(torch.equal(a, b) for a, b in pairs)


def test_the_same_settings_give_the_same_training_and_each_counts(toy_map, settings) -> None:
    surface = toy_map
    once, again = (train(surface, short(settings)) for _ in range(2))
    assert same(once, again)
    rewards = [{**vars(settings.reward), name: value} for name, value in REWARD.items()]
    others = [{name: value} for name, value in CHANGES.items()]
    others += [{"reward": SimpleNamespace(**reward)} for reward in rewards]
    for other in others:
        assert train(surface, short(settings, **other)).curve != once.curve, other


def error_of(trained: Trained) -> float:
    """Mean |y_p - g| [m] by the closed form; every launch is within the force."""
    targets = np.linspace(1.425, 2.425, 256)
    truth = toy.launch(trained.policy.draws(targets))
    assert (truth.hold_force <= 15.0).all()
    return float(np.abs(truth.landing_y - targets).mean())


@pytest.mark.slow
def test_on_simulated_launches_it_hits_without_a_map(toy_map, settings) -> None:
    """Each transition is one launch, and each deterministic check one for every target."""
    launched = []

    def counting(draws: np.ndarray):
        launched.append(len(draws))
        return toy.launch(draws)

    setup = SimpleNamespace(draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, max_force=15.0)
    source = SimulatedLandings(counting, setup)
    trained = train(source, settings)
    steps, iterations = [settings.envs] * settings.steps, settings.iterations
    assert launched == [*steps, 256] * iterations
    assert error_of(trained) == pytest.approx(trained.mean_error) and trained.mean_error <= 0.01
    assert trained.failures.keys() == {TOO_MUCH_FORCE}


def test_a_policy_that_sees_the_projectile_hits_too(seeing, trained, settings) -> None:
    assert error_of(seeing) <= 0.03
    first = seeing.policy.network[0].weight
    assert first.shape == (settings.hidden[0], 3) and not same(seeing, trained)


@pytest.mark.parametrize("first", [1, 8])
def test_a_landing_that_is_no_number_is_refused(toy_map, settings, first: int) -> None:
    """Neither a policy of the iteration before nor a traceback of PyTorch comes of it."""
    surface, calls = toy_map, itertools.count(1)

    class Broken:
        reasons, low, high = surface.reasons, surface.low, surface.high

        def __call__(self, draws: np.ndarray):
            landings = surface(draws)
            if next(calls) < first:
                return landings
            nothing = {"landing_y": np.full(len(draws), np.nan), "failure": 0 * landings.failure}
            return replace(landings, **nothing)

    with pytest.raises(ValueError, match="NaN"):
        train(Broken(), short(settings))
