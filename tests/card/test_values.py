"""Values as people read them, from θ files that people may have edited."""

import pytest

from sling2sim2real.card.values import values

THETA = {"youngs_modulus": 2e5}
CONFIDENCE = {"parameters": {"youngs_modulus": {"low": 1.9e5, "high": 2.1e5}}}


@pytest.mark.parametrize("nuisances", [{}, {"air_drag": None}, {"air_drag": 0.0}])
def test_a_band_without_drag_of_its_own_has_none(nuisances) -> None:
    modulus, drag = values({"theta": THETA, "nuisances": nuisances, "confidence": CONFIDENCE}, {})
    assert (modulus.value, modulus.low, modulus.high) == (200.0, 190.0, 210.0)
    assert (drag.name, drag.value) == ("air_drag", 0.0)
