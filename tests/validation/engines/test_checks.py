"""The comparison where there is nothing to compare with."""

from __future__ import annotations

import sys

import pytest

from pipeline.base.errors import UserError
from pipeline.params import load
from validation.engines import checks
from validation.simulator.finding import Bench


def test_without_mujoco_the_section_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(UserError, match="pip install"):
        checks.section(Bench(load()))


def test_our_tetrahedra_are_compared_on_the_cpu_whatever_the_device():
    same = checks.solid(Bench(load(), device="cuda:0"))
    assert same.device == "cpu" and same.params.sling.mesh == "tetrahedra"
