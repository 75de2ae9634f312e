"""The campaign of the departures: its settings are keys of params.yaml."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from pipeline.base.errors import UserError
from pipeline.base.files import write_json, write_text
from pipeline.params import check, load
from tests.project import DEFAULTS, ROOT
from validation.campaigns import deviations
from validation.campaigns.deviations import BLOCK, OURS, PAGE, PAPER, REPORT, SWITCHES, WORDS
from validation.effects import AS_IS, effects
from validation.marked import marks


@pytest.fixture(autouse=True)
def as_delivered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is a params.yaml that no user edits."""
    monkeypatch.chdir(DEFAULTS.parent)


@pytest.mark.parametrize("switch", [switch for switch in SWITCHES if switch != AS_IS])
def test_a_switch_is_the_key_that_it_is_called_by(switch: str) -> None:
    """As if it were written into params.yaml; tetrahedra want methods with rubber to go first."""
    content = YAML(typ="safe").load(DEFAULTS)
    key, value = switch.split(": ")
    section, name = ("method_defaults", key) if key == "mounting" else key.split(".")
    content[section][name] = {"false": False}.get(value, value)
    params = deviations.params_of("band1", switch)
    if value == "tetrahedra":
        for method in [*content["methods"]]:
            if content["methods"][method].get("law") == "rubber":
                del content["methods"][method]
                content["run"]["methods"].remove(method)
                for step in ("history", "density"):
                    content["run"]["steps"][step].remove(method)
        first = content["run"]["methods"][0]
        content["run"]["own_steps"] = {
            step: [candidate for candidate in names if candidate == first]
            for step, names in content["run"]["steps"].items()
        }
    expected = check(content)
    if section != "method_defaults":
        assert getattr(params, section) == getattr(expected, section)
    assert {n: params.methods[n] for n in expected.methods} == dict(expected.methods)
    assert params != load(DEFAULTS)


def test_cases_are_distinct(tmp_path: Path) -> None:
    cases = deviations.cases_of(["band1", "orange"], 3, 2)
    assert len(cases) == len(set(cases))
    assert {case.method for case in cases if "tetrahedra" in case.switch} == {PAPER}
    places = {deviations.place(tmp_path, "band1", 0, switch) for switch in SWITCHES}
    assert len(places) == 1 + len(deviations.EPISODES_ANEW)


def test_the_rest_of_a_prepared_campaign_needs_no_recorder(tmp_path: Path, monkeypatch) -> None:
    """Nor Open3D, which a machine that only identifies may lack."""
    for module in ("open3d", "pipeline.recording.build", "rig.recorder.record"):
        monkeypatch.setitem(sys.modules, module, None)
    for switch in SWITCHES:
        write_json(deviations.place(tmp_path, "band1", 0, switch) / "mounting.json", {})
    deviations.prepare(("band1", 0), tmp_path, None)
    with pytest.raises(ImportError):
        deviations.prepare(("band1", 1), tmp_path, None)


def report_of(results: list[dict]) -> dict:
    """A campaign's JSON, as far as the page needs it."""
    methods = [PAPER, OURS]
    refused = {"band1, force.cutoff_unit: rad/s": "no slack part"}
    settings = {"search_seeds": {PAPER: 2, OURS: 1}, "recordings": 3, "clamps_refused": refused}
    return {"settings": settings, "figures": effects(results, [*SWITCHES], methods, ["band1"])}


def test_the_report_is_written_into_the_page(tmp_path: Path, monkeypatch) -> None:
    """What stood between the marks goes; all else stays."""
    row = {"band": "band1", "recording": 0, "seed": 1, "peak_force": -0.1, "loss": 1.0}
    results = [
        row | {"method": method, "switch": switch, "youngs_modulus": young, "miss": miss}
        for method in (PAPER, OURS)
        for switch, young, miss in ((AS_IS, 2e5, 0.1), ("mounting: false", 3e5, 0.08))
    ]
    monkeypatch.chdir(tmp_path)
    shutil.copy(DEFAULTS, tmp_path)
    write_json(tmp_path / REPORT, report_of(results))
    begin, end = marks(BLOCK)
    write_text(tmp_path / PAGE, f"# Page\n{begin}old\n{end}more\n")
    monkeypatch.setattr("sys.argv", ["deviations", "--page"])
    deviations.main()
    page = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert page.startswith(f"# Page\n{begin}| as the paper") and page.endswith(f".\n{end}more\n")
    cells = "+50.0 % | −10.0 % | 8.0 cm (−2.0)"
    assert f"`mounting: false` | rig | {cells} | {cells} |\n" in page
    assert "Search seeds: 2 of the paper's method" in page and "ours: 1 a row" in page
    assert "With `force.cutoff_unit: rad/s` no clamps can be calibrated (band1):" in page
    assert "old" not in page and "orange" not in page
    (tmp_path / REPORT).unlink()
    with pytest.raises(UserError, match="deviations.json: missing"):
        deviations.main()


def test_every_setting_is_a_row_and_is_named_where_we_do_otherwise() -> None:
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    assert [*WORDS] == [*SWITCHES]
    assert all(marks(BLOCK)[i] in page for i in (0, 1))
    for switch, words in WORDS.items():
        assert switch == AS_IS or (f"`{switch}`" in page and f"`{switch}`" in words)


@pytest.mark.skipif(not (ROOT / REPORT).exists(), reason="the campaign has not run yet")
def test_the_page_has_the_campaigns_figures() -> None:
    content = json.loads((ROOT / REPORT).read_text(encoding="utf-8"))
    assert deviations.block(content) in (ROOT / PAGE).read_text(encoding="utf-8")
