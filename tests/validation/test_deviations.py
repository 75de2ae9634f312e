"""The campaign of the departures: its settings are keys of params.yaml."""

import json
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from pipeline.params import check, load
from tests.project import ROOT
from validation.campaigns import deviations
from validation.campaigns.deviations import OURS, PAPER, REPORT, SWITCHES
from validation.effects import AS_IS, cell, table


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize("switch", [one for one in SWITCHES if one != AS_IS])
def test_a_switch_is_the_key_that_it_is_called_by(switch: str) -> None:
    """As if it were written into params.yaml; tetrahedra want methods with rubber to go first."""
    content = YAML(typ="safe").load(ROOT / "params.yaml")
    key, value = switch.split(": ")
    section, name = ("method_defaults", key) if key == "mounting" else key.split(".")
    content[section][name] = {"false": False}.get(value, value)
    found = deviations.params_of("band1", switch)
    if value == "tetrahedra":
        for method in [*content["methods"]]:
            if content["methods"][method].get("law") == "rubber":
                del content["methods"][method]
                content["run"]["methods"].remove(method)
    expected = check(content)
    if section != "method_defaults":
        assert getattr(found, section) == getattr(expected, section)
    assert {n: found.methods[n] for n in expected.methods} == dict(expected.methods)
    assert found != load()


def test_every_case_has_a_file_of_its_own(tmp_path: Path) -> None:
    cases = deviations.cases_of(["band1", "orange"], 3, 2)
    assert len({case.path(tmp_path) for case in cases}) == len(cases) == len(set(cases))
    assert {case.method for case in cases if "tetrahedra" in case.switch} == {PAPER}
    places = {deviations.place(tmp_path, "band1", 0, switch) for switch in SWITCHES}
    assert len(places) == 1 + len(deviations.EPISODES_ANEW)


@pytest.mark.skipif(not (ROOT / REPORT).exists(), reason="the campaign has not run yet")
def test_the_page_has_the_campaigns_figures() -> None:
    """docs/paper.md: each row of a setting its cell, and both methods' tables whole."""
    figures = json.loads((ROOT / REPORT).read_text(encoding="utf-8"))["figures"]
    page = (ROOT / "docs/paper.md").read_text(encoding="utf-8").splitlines()
    for switch in SWITCHES:
        rows = [line for line in page if f"`{switch}`" in line and line.endswith("|")]
        expected = cell(figures[PAPER], switch)
        assert switch == AS_IS or any(expected in line for line in rows), (switch, expected)
    for method in (PAPER, OURS):
        lines = table(figures[method], [*SWITCHES])
        start = page.index(lines[2])
        assert page[start - 2 : start - 2 + len(lines)] == lines
