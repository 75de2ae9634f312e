"""One source for both: on a GPU the simulator does what it does on the CPU."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from pipeline.sling import interact, launch

from .test_interaction import random_thetas

pytestmark = pytest.mark.skipif(not wp.is_cuda_available(), reason="no CUDA device on this machine")


def test_interaction_agrees_with_the_cpu(strong_grip, episode):
    """Held force within 0.1 %; the middle of the taut band within 1 mm in the first recoil."""
    thetas = random_thetas(64, seed=2)
    cpu = interact(strong_grip, episode, thetas, workers=2)
    gpu = interact(strong_grip, episode, thetas, device="cuda:0")
    good = np.array(
        [a is None and b is None for a, b in zip(cpu.failure, gpu.failure, strict=True)]
    )
    assert good.sum() >= 62
    held = np.argmin(np.abs(cpu.times - 2.3))
    assert np.allclose(cpu.force[good, held], gpu.force[good, held], rtol=1e-3, atol=5e-3)
    frame = np.searchsorted(cpu.cloud_time, 2.43)
    gap = np.abs(cpu.center_line - gpu.center_line)[good, frame, strong_grip.middle]
    assert np.median(gap) < 1e-4 and np.percentile(gap, 95) < 1e-3


def test_launches_agree_with_the_cpu(sling):
    """Landing within 0.1 %."""
    rng = np.random.default_rng(4)
    draws = np.column_stack([rng.uniform(-0.45, -0.33, 64), rng.uniform(-0.3, -0.1, 64)])
    theta = [2.5e5, 0.45, 2e-3, 0.5, 1.0]
    cpu, gpu = launch(sling, theta, draws), launch(sling, theta, draws, device="cuda:0")
    assert cpu.failure == gpu.failure
    assert gpu.landing_y == pytest.approx(cpu.landing_y, rel=1e-3)
