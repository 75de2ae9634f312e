"""The batch's expected improvement against BoTorch's: samples, value, gradient, climb."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from botorch.acquisition.logei import qLogExpectedImprovement
from botorch.generation import gen_candidates_scipy
from botorch.models import SingleTaskGP
from botorch.sampling.normal import SobolQMCNormalSampler
from scipy.special import ndtr

from pipeline.search.optimizers.improvement import (
    batch_improvement,
    climbed,
    log_improvement,
    normal_samples,
    root,
)
from pipeline.search.optimizers.process import Process
from tests.search.optimizers.test_process import ABOUT, DIMENSION, botorchs, data

BATCH, SAMPLES = 7, 32


def botorch(value: np.ndarray, seed: int = 3) -> tuple[qLogExpectedImprovement, torch.Tensor]:
    """Its acquisition function and, of the samples that this draws, the normal numbers (S, Q)."""
    model: SingleTaskGP = botorchs(data()[0], value, ABOUT).eval()
    sampler = SobolQMCNormalSampler(torch.Size([SAMPLES]), seed=seed)
    with torch.no_grad():
        sampler(model.posterior(torch.rand(1, BATCH, DIMENSION, dtype=torch.float64)))
    acquisition = qLogExpectedImprovement(model, best_f=value.max(), sampler=sampler)
    return acquisition, sampler.base_samples[:, 0]


def batch(seed: int = 4) -> np.ndarray:
    return np.random.default_rng(seed).random((BATCH, DIMENSION))


@pytest.mark.parametrize("lift", [0.0, 3.0, -3.0])
def test_value_and_slope_are_botorchs(lift: float) -> None:
    """Also where the batch is sure to improve, and where it hardly can."""
    unit, value = data()
    acquisition, normal = botorch(value)
    acquisition.best_f -= lift
    free = torch.tensor(batch(), requires_grad=True)
    expected = acquisition(free[None])[0]
    expected.backward()
    process, best = Process(unit, value, ABOUT), value.max() - lift
    found, slope = batch_improvement(process, free.detach(), best, normal)
    assert found.item() == pytest.approx(expected.item(), rel=1e-8)
    scale = free.grad.abs().max().item()
    assert scale > 0
    np.testing.assert_allclose(slope, free.grad, rtol=1e-6, atol=1e-7 * scale)


@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e-3, 1.0, 1e3])
def test_slope_of_the_logarithm_is_autograds(scale: float) -> None:
    """At all scales of improvement, through BoTorch's own functions."""
    rng = np.random.default_rng(5)
    over = torch.tensor(scale * rng.normal(size=(SAMPLES, BATCH)), requires_grad=True)
    acquisition, _ = botorch(data()[1])
    acquisition.best_f = torch.tensor(0.0, dtype=torch.float64)
    utility = acquisition._sample_forward(over[:, None])
    expected = acquisition._sample_reduction(acquisition._q_reduction(utility))[0]
    expected.backward()
    value, slope = log_improvement(over.detach())
    assert value.item() == pytest.approx(expected.item(), rel=1e-9)
    np.testing.assert_allclose(slope, over.grad, rtol=1e-7, atol=1e-12 * over.grad.abs().max())


def test_a_climb_ends_where_botorchs_does() -> None:
    """After few steps; and after many it is higher."""
    unit, value = data()
    acquisition, normal = botorch(value)
    process, start, best = Process(unit, value, ABOUT), batch(), value.max()
    expected, _ = gen_candidates_scipy(
        torch.from_numpy(start)[None],
        acquisition,
        lower_bounds=0.0,
        upper_bounds=1.0,
        options={"maxiter": 5},
    )
    few = climbed(process, start, best, normal, 5)
    np.testing.assert_allclose(few, expected[0], atol=1e-3)  # BoTorch's process rounds otherwise
    assert np.abs(few - start).max() > 0.1
    many = climbed(process, start, best, normal, 30)
    assert ((many >= 0) & (many <= 1)).all()
    heights = [
        batch_improvement(process, torch.from_numpy(points), best, normal)[0]
        for points in (start, few, many)
    ]
    assert heights[0] < heights[1] < heights[2]


def test_points_that_are_alike_have_a_slope_too() -> None:
    """The covariance is singular then; BoTorch takes the same jitter."""
    unit, value = data()
    points = torch.from_numpy(batch())
    points[2] = points[5]
    acquisition, normal = botorch(value)
    with pytest.warns(match="jitter"):
        expected = acquisition(points[None]).item()
    process = Process(unit, value, ABOUT)
    found, slope = batch_improvement(process, points, value.max(), normal)
    assert found.item() == pytest.approx(expected, rel=1e-5)
    assert torch.isfinite(slope).all()
    singular = torch.ones((4, 4), dtype=torch.float64)
    np.testing.assert_allclose(root(singular) @ root(singular).mT, singular, atol=1e-7)


def test_normal_samples_are_a_net_at_each_turn() -> None:
    """One number in each of 64 slices of equal probability, in every dimension."""
    first, second, again, other = (
        normal_samples(64, 400, seed, turn) for seed, turn in ((1, 1), (1, 2), (1, 1), (2, 1))
    )
    for sample in (first, second, other):
        slices = np.floor(64 * ndtr(sample.numpy()))
        np.testing.assert_array_equal(np.sort(slices, axis=0), np.tile(np.arange(64)[:, None], 400))
    assert torch.equal(first, again)
    for one in (second, other):
        assert abs(np.corrcoef(first.flatten(), one.flatten())[0, 1]) < 0.15
