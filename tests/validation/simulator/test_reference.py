"""The twin's forces are its energy's slope, and the kernel takes the same steps within 1e-7."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.sling.model import hanging_guess
from validation.simulator import agreement
from validation.simulator.closed import String
from validation.simulator.experiment import band_of
from validation.simulator.march import jacobian
from validation.simulator.reference import Twin

from .kept import assert_kept

THETA = (5e5, 0.42, 3e-3, 0.5, 0.6)


def rough(sling) -> np.ndarray:
    rng = np.random.default_rng(0)
    size = np.where(np.arange(9) < 3, 2e-4, 2e-2)
    return hanging_guess(sling) + size * rng.normal(size=(sling.layers, 9))


@pytest.mark.parametrize("gripped", [False, True])
@pytest.mark.parametrize("clamped", [(True, True), (True, False)])
def test_gradient_is_the_energys_slope(bench, clamped, gripped):
    sling = replace(band_of(bench), clamped=clamped, clamp_twist=0.3)
    twin = Twin(sling, THETA, gripped=gripped)
    layers = rough(sling)
    gradient = twin.gradient(layers)
    for layer, unknown in np.ndindex(sling.layers - 1, 9):
        step = np.zeros_like(layers)
        step[layer, unknown] = 1e-6
        slope = (twin.elastic(layers + step) - twin.elastic(layers - step)) / 2e-6
        assert gradient[layer, unknown] == pytest.approx(slope, rel=1e-6, abs=1e-7)


def test_viscous_force_is_the_rate_of_the_elastic_force(bench):
    """At s = 1 and a stretched state: d times the tangent, edge by edge."""
    sling = band_of(bench)
    twin = Twin(sling, (5e5, 0.42, 1.0, 0.5, 1.0))
    rng = np.random.default_rng(1)
    layers = np.zeros((sling.layers, 9))
    layers[:, 0] = 1.5 * sling.arc
    # in uniaxial stress, where the bound that keeps slack states dissipative does not bind
    layers[:, 4] = layers[:, 8] = np.sqrt(String.of(sling, twin.theta).volume(1.5) / 1.5)
    rate = rng.normal(size=layers.shape)
    step = 1e-6
    tangent = (twin.stress(layers + step * rate) - twin.stress(layers - step * rate)) / (2 * step)
    viscous = twin.viscous_stress(rate, layers)
    assert np.abs(viscous - tangent).max() < 1e-6 * np.abs(tangent).max()


def test_jacobian_is_the_residuals_slope(bench):
    twin = Twin(band_of(bench), THETA)
    layers = rough(twin.sling)

    def residual(x):
        return twin.internal(x, x - layers, layers)

    slope = jacobian(residual, layers)
    rng = np.random.default_rng(2)
    rate = rng.normal(size=layers.shape)
    step = 1e-7
    expected = (residual(layers + step * rate) - residual(layers - step * rate)) / (2 * step)
    found = np.einsum("ijkl,kl->ij", slope, rate)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def test_kernel_takes_the_twins_steps(bench):
    assert_kept(agreement.checks(bench, count=2))
