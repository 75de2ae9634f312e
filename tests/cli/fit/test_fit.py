"""`sling fit`: what it brings in, what it asks DVC for, what it refuses, and its screen."""

import json
import re
import shutil
from types import SimpleNamespace

import pytest

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import cli
from sling2sim2real.cli.fit import fit as module
from sling2sim2real.cli.fit.screen import shown
from tests.project import DEFAULTS

CARD = {
    "band": "mine",
    "verdict": "with care",
    "reasons": ["It is not settled."],
    "values": [
        {"label": "stiffness E", "unit": "kPa", "value": 412.3, "low": 401, "high": 423.4}
        | {"fixed": False},
        {"label": "Poisson's ratio", "unit": "", "value": 0.47, "low": None, "high": None}
        | {"fixed": True},
    ],
    "draws": [
        {"target_m": 1.725, "draw_y_m": -0.3, "draw_z_m": -0.15, "predicted_landing_m": 1.726}
        | {"interval_90_m": [1.6, 1.9], "hold_force_n": 9.06},
        {"target_m": 2.1, "draw_y_m": -0.4, "draw_z_m": -0.2, "predicted_landing_m": None}
        | {"interval_90_m": None, "hold_force_n": None},
    ],
    "next": ["Measure a launch."],
}
LAUNCHES = "draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.17,2.2\n-0.32,-0.2,3.0\n"


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project without bands of its own, whose recordings are all fine and whose DVC succeeds."""
    shutil.copy(DEFAULTS, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sling2sim2real.cli.preflight.recordings.checked", lambda *given: [])
    requested, layout = [], Layout(tmp_path)

    def repro(root, stage, on_line):
        requested.append(stage)
        band = stage.partition("@")[2]
        layout.card(band).mkdir(parents=True, exist_ok=True)
        (layout.card(band) / "card.json").write_text(json.dumps(CARD | {"band": band}))
        on_line(f"{band}: settled")

    monkeypatch.setattr(module, "repro", repro)

    def recording(name: str, content: str):
        (tmp_path / name).write_text(content)
        return tmp_path / name

    def run(*files, name=None, launches=None, **band) -> dict:
        return module.fit(files, name, module.NewBand(**band), launches, tmp_path)

    return SimpleNamespace(run=run, recording=recording, requested=requested, layout=layout)


def test_a_new_band_is_added_and_its_card_made(project) -> None:
    file = project.recording("My band 2.mcap", "a")
    card = project.run(file, mass=0.04, rest_length=0.5)
    assert card["band"] == "my_band_2" and card["card"].endswith("bands/my_band_2/README.md")
    band_params = load().bands["my_band_2"]
    assert (band_params.mass, band_params.rest_length, band_params.diameter) == (0.04, 0.5, 0.01)
    assert project.requested == ["own_card@my_band_2"]
    again = project.run(file, mass=0.04, rest_length=0.5)
    assert again == card and load().run.own[-1] == "my_band_2"
    assert project.run(name="my_band_2") == card


def test_further_recordings_join_those_that_are_there(project) -> None:
    first, second = project.recording("a.mcap", "a"), project.recording("b.mcap", "b")
    project.run(first, mass=0.04)
    project.run(first, second, name="a")
    assert [file.name for file in project.layout.recordings("a")] == ["a.mcap", "b.mcap"]
    project.run(first, name="a")  # the same command goes on
    with pytest.raises(UserError, match="other recordings already"):
        project.run(project.recording("c.mcap", "c"), name="a")
    with pytest.raises(UserError, match="none.mcap"):
        project.run(first.with_name("none.mcap"), name="a")


def test_launches_become_evidence_once(project) -> None:
    file = project.recording("a.mcap", "a")
    launches = project.recording("landings.csv", LAUNCHES + "-0.3,-0.17,2.2\n")
    for _ in range(2):
        project.run(file, mass=0.04, launches=launches)
        assert (project.layout.evidence / "a.csv").read_text() == (
            "draw_y_m,draw_z_m,draw_error_m,landing_y_m\n"
            "-0.3,-0.17,,2.2\n-0.32,-0.2,,3.0\n-0.3,-0.17,,2.2\n"
        )
    project.layout.measured.mkdir(parents=True)
    (project.layout.measured / "a.csv").write_text(LAUNCHES.replace("3.0", "3.1"))
    more = project.recording("more.csv", LAUNCHES.replace("3.0", "3.1"))
    with pytest.raises(UserError, match="evidence or a score, never both"):
        project.run(file, launches=more)
    other = project.recording("other.mcap", "b")
    (project.layout.measured / "other.csv").write_text(LAUNCHES)
    with pytest.raises(UserError, match="evidence or a score, never both"):
        project.run(other, mass=0.04, launches=launches)
    assert "other" not in load().bands  # nothing has changed


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "a: is new; weigh the band and give --mass KG"),
        ({"mass": 0.04, "name": "Big"}, "use small letters"),
        ({"mass": 0.04, "name": "band1"}, "band1: is a band of the virtual rig"),
        ({"mass": 0.04, "launches": "none.csv"}, "none.csv: no such file"),
        ({"mass": 0.04, "launches": "bad.csv"}, "bad.csv, line 2: a launch that did not land"),
        ({"mass": 0.04, "launches": "empty.csv"}, "empty.csv: holds no launch"),
    ],
)
def test_what_is_wrong_is_said_before_anything_changes(project, given, message) -> None:
    file = project.recording("a.mcap", "a")
    project.recording("bad.csv", "draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.17,\n")
    project.recording("empty.csv", "draw_y_m,draw_z_m,landing_y_m\n")
    if "launches" in given:
        given = given | {"launches": file.with_name(given["launches"])}
    with pytest.raises(UserError, match=message):
        project.run(file, **given)
    assert (file.parent / "params.yaml").read_text() == DEFAULTS.read_text()
    assert project.requested == [] and not project.layout.data.exists()


def test_a_band_must_be_known_or_recorded(project) -> None:
    for given, message in (
        ({}, "give a recording"),
        ({"name": "none"}, "none: is no band of params.yaml, which has band1, band2, band3"),
    ):
        with pytest.raises(UserError, match=message):
            project.run(**given)
    with pytest.raises(UserError, match="makes no band name; give one: --name NAME"):
        project.run(project.recording("2026.mcap", "a"), mass=0.04)


def test_sizes_of_a_known_band_take_the_place_of_the_old_ones(project, capsys) -> None:
    """Alone, and with its recordings; what says it is the line with both."""
    file = project.recording("a.mcap", "a")
    project.run(file, mass=0.4)
    path = file.parent / "params.yaml"
    first = path.read_text()
    project.run(name="a", mass=0.04, rest_length=0.52)  # which is 0.52 already
    assert f"{path}: bands.a.mass was 0.4, is 0.04 now\n" in capsys.readouterr().err
    assert path.read_text() == first.replace("mass: 0.4\n", "mass: 0.04\n")
    project.run(file, name="a", diameter=0.011, rest_length=0.5)
    output = capsys.readouterr().err
    assert "bands.a.diameter was 0.01, is 0.011 now" in output and "rest_length was 0.52" in output
    band = load().bands["a"]
    assert (band.mass, band.diameter, band.rest_length) == (0.04, 0.011, 0.5)
    assert project.requested == ["own_card@a"] * 3


def test_sizes_that_cannot_be_or_what_fails_with_them_change_nothing(project, capsys) -> None:
    file = project.recording("a.mcap", "a")
    project.run(file, mass=0.04)
    path = file.parent / "params.yaml"
    before = path.read_text()
    for files, given, message in (
        ((), {"name": "a", "rest_length": 0.2}, "bands.a.rest_length: 0.2 must be longer than"),
        ((), {"name": "band1", "mass": 0.03}, "band1: is a band of the virtual rig"),
        ((project.recording("c.mcap", "c"),), {"name": "a", "mass": 0.05}, "other recordings"),
    ):
        with pytest.raises(UserError, match=message):
            project.run(*files, **given)
        assert path.read_text() == before
    assert "params.yaml: is as it was" in capsys.readouterr().err
    assert len(project.requested) == 1


def test_a_recorded_band_among_those_of_all_methods_is_reported(project, capsys) -> None:
    project.run(project.recording("a.mcap", "a"), mass=0.04)
    path = project.layout.root / "params.yaml"
    text = path.read_text().replace("  own:", "  own: []", 1).replace("  - a\n", "", 1)
    path.write_text(text.replace("  - band3\n", "  - band3\n  - a\n", 1))
    project.run(name="a")
    assert project.requested[-1] == "card@a"
    assert "under run.own instead it gets its card alone" in capsys.readouterr().err


def test_the_screen() -> None:
    text = shown(CARD | {"card": "reports/bands/mine/README.md"})
    lines = text.splitlines()
    assert lines[:2] == ["mine: with care", "  - It is not settled."]
    assert "  stiffness E      412.3 kPa  (401 to 423.4)" in lines
    assert "  Poisson's ratio  0.47, fixed" in lines
    assert any(
        "1.725 m" in line and "1.600 to 1.900 m" in line and "9.1 N" in line for line in lines
    )
    assert any("fails in simulation" in line for line in lines)
    assert lines[-2] == "Card: reports/bands/mine/README.md" and len(lines) < 25
    page = re.fullmatch(r"Page: file://(/.*/reports/bands/mine/index\.html)", lines[-1])
    assert page


def test_the_command(project, monkeypatch, capsys) -> None:
    file = project.recording("a.mcap", "a")
    arguments = cli.parser().parse_args(["fit", str(file), "--mass", "0.04", "--json"])
    assert cli.execute(arguments) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {"band", "verdict", "draws", "card"} <= answer.keys()


def test_evidence_that_is_wrong_is_said_before_any_stage(project) -> None:
    file = project.recording("a.mcap", "a")
    project.layout.evidence.mkdir(parents=True)
    (project.layout.evidence / "gone.csv").write_text(LAUNCHES)
    with pytest.raises(UserError, match=r"gone.csv: no band of params.yaml goes by that name"):
        project.run(file, mass=0.04)
    assert project.requested == []
