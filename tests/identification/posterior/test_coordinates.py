"""Coordinates: there and back, the loss factor's formula, bounds, steps and priors."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from sling2sim2real.base.parameters import TAN_DELTA
from sling2sim2real.identification.posterior.coordinates import Coordinates
from sling2sim2real.settings.identification import LAWS, UNSEEN
from sling2sim2real.simulator.parameters import EXTRA, Parameters
from tests.identification.objective.pulls import PARAMS, sling_of

METHOD = "posterior"
SLING = replace(sling_of(0.03), law="rubber")
OURS = Coordinates.of_method(PARAMS, METHOD, SLING)


def within(part: np.ndarray) -> np.ndarray:
    return OURS.low + part * (OURS.high - OURS.low)


UNIT = st.lists(st.floats(0.0, 1.0), min_size=len(OURS.names), max_size=len(OURS.names))


@given(UNIT)
def test_there_and_back(part):
    """What a θ file's θ holds comes back; the rest is as expected."""
    phi = within(np.array(part))
    back = OURS.of(OURS.parameters(phi[None]))
    count = len(OURS.names) - len(EXTRA)
    np.testing.assert_allclose(back[:count], phi[:count], atol=1e-9)
    np.testing.assert_array_equal(back[count:], OURS.expected[count:])


def test_the_loss_factor_is_what_a_wave_loses_along_the_band():
    """s d c/L with c^2 = E A L/m."""
    phi = within(np.linspace(0.2, 0.8, len(OURS.names)))
    values = OURS.parameters(phi[None]).sample()
    named = dict(zip(OURS.names, phi, strict=True))
    young = values["youngs_modulus"]
    speed = np.sqrt(young * SLING.area * SLING.rest_length / SLING.mass)
    product = values["elasticity_damping"] * values["damping_scale"]
    assert np.log(young) == pytest.approx(named["log_youngs_modulus"])
    assert np.log(product * speed / SLING.rest_length) == pytest.approx(named["log_loss_factor"])
    assert np.log(values["returned_share"]) == pytest.approx(named["log_returned_share"])
    same = *LAWS["rubber"], "air_drag", "turn_damping"
    assert [values[name] for name in same] == [named[name] for name in same]
    fixed = PARAMS.methods[METHOD].fixed
    assert {*UNSEEN} == {*fixed} and {name: values[name] for name in fixed} == fixed


def test_bounds_are_the_boxs_the_methods_and_what_is_possible():
    """The loss factor's are those of damping's box at E's two ends."""
    ends = dict(zip(OURS.names, zip(OURS.low, OURS.high, strict=True), strict=True))
    bounds = PARAMS.methods[METHOD].bounds
    assert all(ends[name] == bounds[name] for name in LAWS["rubber"])
    assert ends["air_drag"] == (0.0, 8.0) and ends["turn_damping"] == (0.0, 1.0)
    assert ends["log_returned_share"] == (-0.3, 0.3)
    box = PARAMS.parameters
    for corner, side in ((OURS.low, "low"), (OURS.high, "high")):
        values = OURS.parameters(corner[None]).sample()
        for name in ("youngs_modulus", "elasticity_damping"):
            assert values[name] == pytest.approx(getattr(getattr(box, name), side))


def test_half_of_the_rubbers_do_not_soften():
    """The rest of the prior is half of a Gaussian, cut off at 0.6."""
    parts = np.full((2000, len(OURS.names)), np.linspace(0.0005, 0.9995, 2000)[:, None])
    softening = OURS.quantiles(parts)[:, OURS.names.index("softening")]
    some = softening[softening > 0]
    assert len(some) / 2000 == pytest.approx(1 - 0.5 / norm.cdf(2.0), abs=0.002)
    middle = 0.3 * norm.ppf((0.5 + norm.cdf(2.0)) / 2)
    assert np.median(some) == pytest.approx(middle, rel=0.01)


def test_a_start_outside_comes_to_the_bounds():
    five = [1e9, 0.47, 1.0, 0.7, 0.6]
    theta = Parameters.of("rubber", five, mooney_share=-5.0, relaxation=1.0)
    phi = OURS.of(theta)
    assert np.all(phi >= OURS.low) and np.all(phi <= OURS.high)
    assert phi[0] == OURS.high[0] and phi[2] == OURS.low[2]


def test_narrower_bounds_and_other_fixed_values_of_the_method_count():
    method = PARAMS.methods[METHOD]
    fixed = method.fixed | {"damping_scale": 0.3}
    bounds = method.bounds | {"youngs_modulus": (2e5, 4e5)}
    mine = method.model_copy(update={"fixed": fixed, "bounds": bounds})
    params = PARAMS.model_copy(update={"methods": PARAMS.methods | {METHOD: mine}})
    other = Coordinates.of_method(params, METHOD, SLING)
    assert (other.low[0], other.high[0]) == pytest.approx(tuple(np.log([2e5, 4e5])))
    phi = other.expected.copy()
    ours, theirs = (each.parameters(phi[None]) for each in (OURS, other))
    twice = theirs.column("elasticity_damping")[0] / ours.column("elasticity_damping")[0]
    assert twice == pytest.approx(2.0)  # of the same product


def test_priors_are_even_or_as_published():
    """An even one's ends by hand; tan delta = pi eta of 9 rubbers in 10; a rectified Gaussian."""
    low, high = OURS.prior(0.9)
    place = OURS.names.index
    i = place("mooney_share")
    assert (low[i], high[i]) == pytest.approx((-1.0 + 0.05 * 1.9, 0.9 - 0.05 * 1.9))
    i = place("log_loss_factor")
    np.testing.assert_allclose(np.pi * np.exp([low[i], high[i]]), TAN_DELTA, rtol=1e-3)
    i = place("softening")
    upper = 0.3 * norm.ppf(0.95 * norm.cdf(2.0))  # of a Gaussian of 0.3 that is cut off at 0.6
    np.testing.assert_allclose([low[i], high[i]], [0.0, upper], rtol=1e-6)
    assert OURS.shows("youngs_modulus") == 0 and OURS.shows("dynamic_friction") is None
