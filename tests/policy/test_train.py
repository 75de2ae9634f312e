"""Training on the toy slingshot, whose landing is known in closed form."""

from __future__ import annotations

import numpy as np
import torch

from pipeline.policy.train import train
from tests.policy import toy


def test_the_policy_hits_the_closed_form_within_a_centimetre(trained) -> None:
    targets = np.linspace(1.425, 2.425, 256)
    with torch.inference_mode():
        draws = trained.policy(torch.tensor(targets, dtype=torch.float32)[:, None]).double().numpy()
    truth = toy.launch(draws)
    error = np.abs(truth.landing_y - targets)
    assert error.mean() <= 0.01
    assert (truth.hold_force <= 15.0).all()
    assert trained.converged and trained.failed_targets == 0
    np.testing.assert_allclose(trained.mean_error, error.mean(), atol=1e-4)
    np.testing.assert_allclose(trained.max_error, error.max(), atol=1e-4)


def test_the_curve_has_one_row_an_iteration(trained, settings) -> None:
    curve = trained.curve
    assert curve["iteration"] == list(range(1, settings.iterations + 1))
    assert (
        curve["mean_error"][trained.iteration - 1] == trained.mean_error == min(curve["mean_error"])
    )
    assert curve["mean_reward"][-1] > curve["mean_reward"][0]
    assert sum(curve["failures"]) == sum(trained.failures.values()) > 0


def test_the_same_seed_gives_the_same_network(toy_map, settings) -> None:
    def weights(seed: int) -> list[torch.Tensor]:
        short = type(settings)(**{**vars(settings), "iterations": 2, "envs": 64, "seed": seed})
        return list(train(toy_map, short).policy.parameters())

    once, again, other = weights(1), weights(1), weights(2)
    assert all(torch.equal(a, b) for a, b in zip(once, again, strict=True))
    assert not all(torch.equal(a, b) for a, b in zip(once, other, strict=True))


def test_says_that_it_did_not_converge(toy_map, settings) -> None:
    short = type(settings)(**{**vars(settings), "iterations": 1, "envs": 64})
    assert not train(toy_map, short).converged
