"""Each of the five parameters does what its definition says."""

from __future__ import annotations

import pytest

from validation.simulator import five_parameters as parameters

from .kept import assert_kept


@pytest.mark.parametrize("name", ["young", "poisson", "damping", "friction"])
def test_parameter_does_what_its_definition_says(bench, name):
    assert_kept(getattr(parameters, name)(bench))
