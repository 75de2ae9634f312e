"""The comparison where there is nothing to compare with."""

from __future__ import annotations

import sys

from pipeline.params import load
from pipeline.peers import checks
from pipeline.verify.check import Bench


def test_without_mujoco_the_section_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    section = checks.section(Bench(load()))
    assert not section.checks
    assert "pip install -e '.[validation]'" in section.text
