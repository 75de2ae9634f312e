"""The box of the search."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pipeline.params import load
from sling2sim2real.identification.objective.box import SearchBox, reflect
from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.parameters import THETA
from tests.project import DEFAULTS

BOX = SearchBox.of(load(DEFAULTS).parameters)
CUBE = arrays(float, (3, 5), elements=st.floats(0, 1))


@given(CUBE)
def test_there_and_back(unit: np.ndarray) -> None:
    theta = BOX.to_physical(unit)
    assert np.all((theta >= BOX.low) & (theta <= BOX.high))
    np.testing.assert_allclose(BOX.to_unit(theta), unit, atol=1e-12)


def test_scales() -> None:
    """Corners are the bounds; the centre is the geometric or the arithmetic mean."""
    assert BOX.names == THETA
    np.testing.assert_allclose(BOX.to_physical(np.zeros(5)), BOX.low, rtol=1e-14)
    np.testing.assert_allclose(BOX.to_physical(np.ones(5)), BOX.high, rtol=1e-14)
    middle = dict(zip(THETA, BOX.to_physical(np.full(5, 0.5)), strict=True))
    assert middle["youngs_modulus"] == pytest.approx(np.sqrt(3e4 * 1e7))
    assert middle["poissons_ratio"] == pytest.approx((0.30 + 0.49) / 2)


def test_what_a_law_adds_are_the_last_axes() -> None:
    """In one order, whatever that of the bounds; linear, between them."""
    bounds = {
        "log_flow_rate": (0.0, 5.0),
        "softening": (0.0, 0.6),
        "flow": (0.0, 0.5),
        "relaxation": (0.0, 0.05),
        "upturn": (0.0, 0.3),
        "mooney_share": (-0.3, 0.9),
    }
    box = SearchBox.of(load(DEFAULTS).parameters, bounds, "rubber")
    assert box.names == (*THETA, *LAWS["rubber"]) and box.dimension == 11
    theta = box.to_physical(np.full(11, 0.5))
    np.testing.assert_array_equal(theta[:5], BOX.to_physical(np.full(5, 0.5)))
    np.testing.assert_allclose(theta[5:], [0.3, 0.15, 0.3, 0.025, 0.25, 2.5], atol=1e-15)
    np.testing.assert_allclose(box.to_unit(theta), np.full(11, 0.5))


@given(arrays(float, (3, 5), elements=st.floats(-1e6, 1e6)))
def test_reflection_lands_inside_and_is_idempotent(unit: np.ndarray) -> None:
    inside = reflect(unit)
    assert np.all((inside >= 0) & (inside <= 1))
    np.testing.assert_array_equal(reflect(inside), inside)  # and keeps what is inside


def test_reflection_is_a_mirror_at_the_faces() -> None:
    outside = np.array([-0.2, 1.2, 2.1, -1.3, -2.0, 0.3])
    np.testing.assert_allclose(reflect(outside), [0.2, 0.8, 0.1, 0.7, 0.0, 0.3], atol=1e-12)


def test_there_and_back_as_parameters() -> None:
    """What has no axis is as fixed, or as usual."""
    box = SearchBox.of(load(DEFAULTS).parameters, fixed={"poissons_ratio": 0.45, "air_drag": 0.7})
    assert box.free == tuple(name for name in THETA if name != "poissons_ratio")
    unit = box.fill(np.full((2, 4), [[0.25], [0.75]]))
    parameters = box.parameters(box.to_physical(unit))
    np.testing.assert_allclose(parameters.column("poissons_ratio"), 0.45, rtol=1e-12)
    assert parameters.column("air_drag").tolist() == [0.7, 0.7]
    assert parameters.column("returned_share").tolist() == [1.0, 1.0]
    np.testing.assert_allclose(box.unit_of(parameters), unit, atol=1e-12)
