"""The box of the search."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pipeline.identify.objective.space import Space, reflect
from pipeline.params import load
from pipeline.simulator.material import THETA

SPACE = Space.of(load().parameters)
CUBE = arrays(float, (3, 5), elements=st.floats(0, 1))


@given(CUBE)
def test_there_and_back(unit: np.ndarray) -> None:
    theta = SPACE.to_physical(unit)
    assert np.all((theta >= SPACE.low) & (theta <= SPACE.high))
    np.testing.assert_allclose(SPACE.to_unit(theta), unit, atol=1e-12)


def test_scales() -> None:
    """Corners are the bounds; the centre is the geometric or the arithmetic mean."""
    assert SPACE.names == THETA
    np.testing.assert_allclose(SPACE.to_physical(np.zeros(5)), SPACE.low, rtol=1e-14)
    np.testing.assert_allclose(SPACE.to_physical(np.ones(5)), SPACE.high, rtol=1e-14)
    middle = dict(zip(THETA, SPACE.to_physical(np.full(5, 0.5)), strict=True))
    assert middle["youngs_modulus"] == pytest.approx(np.sqrt(3e4 * 1e7))
    assert middle["poissons_ratio"] == pytest.approx((0.30 + 0.49) / 2)


def test_what_a_law_adds_are_the_last_axes() -> None:
    """In one order, whatever that of the bounds; linear, between them."""
    bounds = {"relaxation": (0.0, 0.05), "mooney_share": (-0.3, 0.9)}
    space = Space.of(load().parameters, bounds, "rubber")
    assert space.names == (*THETA, "mooney_share", "relaxation")
    assert space.dimension == 7
    theta = space.to_physical(np.full(7, 0.5))
    np.testing.assert_array_equal(theta[:5], SPACE.to_physical(np.full(5, 0.5)))
    np.testing.assert_allclose(theta[5:], [0.3, 0.025], atol=1e-15)
    np.testing.assert_allclose(space.to_unit(theta), np.full(7, 0.5))


@given(arrays(float, (3, 5), elements=st.floats(-1e6, 1e6)))
def test_reflection_lands_inside_and_is_idempotent(unit: np.ndarray) -> None:
    inside = reflect(unit)
    assert np.all((inside >= 0) & (inside <= 1))
    np.testing.assert_array_equal(reflect(inside), inside)  # and keeps what is inside


def test_reflection_is_a_mirror_at_the_faces() -> None:
    outside = np.array([-0.2, 1.2, 2.1, -1.3, -2.0, 0.3])
    np.testing.assert_allclose(reflect(outside), [0.2, 0.8, 0.1, 0.7, 0.0, 0.3], atol=1e-12)
