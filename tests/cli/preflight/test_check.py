"""What `sling check` says of recordings whose truth is a formula."""

import json
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from sling2sim2real.api.band_folder import BandFolder
from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.cli.preflight.check import look_at
from sling2sim2real.cli.preflight.command import check, check_band, checked
from sling2sim2real.cli.preflight.report import new_report, pull_line, to_json, to_text
from sling2sim2real.recording.checks import Finding
from tests.cli.preflight.conftest import band_of
from tests.hostile import MARKUP
from tests.project import with_
from validation.recordings.bag import (
    HAND,
    RADIUS,
    SENSOR,
    START,
    Truth,
    blind_bag,
    edit,
    write_bag,
)


def abouts(report) -> set[str]:
    return {caution["about"] for caution in report["cautions"]}


def test_the_report_of_a_good_recording(looked, seen) -> None:
    report, truth = looked.report, seen[1]
    content = json.loads(to_json(report))
    assert content["usable"] and content["verdict"] == "can be used, but:"
    signals = content["signals"]
    assert signals["release_s"] == pytest.approx(truth.release, abs=1e-3)
    assert abs(signals["release_s"] - truth.release) < 4 * signals["release_error_s"]
    assert abs(signals["grasp_s"] - truth.grasp) <= signals["grasp_error_s"]
    peak = np.linalg.norm(truth.force(truth.release - 0.01))
    assert signals["peak_force_n"] == pytest.approx(peak, rel=0.02)
    assert content["cloud"]["taut_coverage"] > 0.9
    assert content["cloud"]["taut_offset_m"] == pytest.approx(RADIUS, abs=0.002)
    sizes = {"diameter_m": 0.010, "rest_length_m": 0.52, "mass_kg": None}
    source = "assumed: --diameter 0.01 and --rest-length 0.52; give yours"
    assert content["band"] == sizes | {"source": source}
    roles = {row["role"]: row for row in content["topics"] if row["role"]}
    assert {"wrench", "pose", "gripper", "color", "depth"} <= set(roles)
    assert roles["wrench"]["topic"] == "/ft/wrench" and roles["wrench"]["why"]
    assert roles["color"]["rate"] == pytest.approx(15, rel=0.01)
    assert set(content["delays"]) == {"pose", "camera"}
    text = to_text(report)
    assert "/ft/wrench" in text and "fork tips off" in text and "can be used" in text


def test_the_verdict_and_its_cautions_come_first(looked) -> None:
    """Then what it rests on; of several pulls, of which it is."""
    cautions = [Finding("gap", "the force has a gap", "record it again").content()]
    for problem, verdict in ((None, "can be used, but:"), ("no force", "cannot be used: no force")):
        report = looked.report | {"cautions": cautions, "problem": problem}
        lines = to_text(report).splitlines()
        assert lines[2:4] == [verdict, "  - the force has a gap: record it again"]
        assert lines.index("it rests on") < lines.index("signals")
    pulls = [pull_line(looked.report) | {"number": number} for number in (1, 2)]
    lines = to_text(looked.report | {"pulls": pulls, "cautions": cautions}).splitlines()
    assert lines[2] == "pull 1 of 2: can be used, but:"


def test_what_is_wrong_is_said_with_its_cure(tmp_path, params) -> None:
    """No gripper, a slow camera, a lost second of force, a short pause, too much force."""

    def lose(stamp: int, message) -> bool:
        return not 1.3 < (stamp - START) * 1e-9 < 1.35

    path = tmp_path / "poor.mcap"
    write_bag(path, Truth(noise=0.6), rate=500, change=edit(wrench=lose, gripper=lambda *_: False))
    report = look_at(path, with_(params, "setup", max_force=15.0), band_of(params)).report
    assert report["problem"] is None
    output = {"gripper", "rate", "gap", "pause", "max_force"}
    assert output <= abouts(report)
    text = to_text(report)
    for caution in report["cautions"]:
        assert caution["cure"] and f"  - {caution['what']}: {caution['cure']}" in text.splitlines()


def test_the_choice_of_topics_can_be_pasted(looked) -> None:
    """It is YAML as a band's settings hold it, also where one topic plays two roles."""

    def pasted(topics: list[dict]) -> dict:
        _, _, text = to_text(looked.report | {"topics": topics}).partition("in band.yaml)\n")
        return YAML(typ="safe").load(text)["settings"]["setup"]["topics"]

    topics = looked.report["topics"]
    assert pasted(topics) == {row["role"]: row["topic"] for row in topics if row["role"]}
    both = [
        row | {"role": "wrench, pose"} if row["topic"] == "/ft/wrench" else row
        for row in topics
        if row["role"] != "pose"
    ]
    assert pasted(both)["pose"] == "/ft/wrench"
    odd = [row | {"topic": f"{row['topic']} #1: {{"} for row in topics]
    assert pasted(odd)["wrench"] == "/ft/wrench #1: {"


def test_the_report_of_a_bad_recording(tmp_path, params) -> None:
    path = blind_bag(tmp_path, change=edit(wrench=lambda *_: False))
    report = look_at(path, params, band_of(params)).report
    assert "no force" in json.loads(to_json(report))["problem"]
    assert "cannot be used: no force" in to_text(report)
    assert "/arm/current_pose" in to_text(report)


def test_a_report_without_pictures_of_the_band_has_its_signals(refused, blind) -> None:
    report, truth = refused.report, blind[1]
    assert report["problem"] and not report["phases"] and not report["extrinsics"]
    assert report["signals"]["release_s"] == pytest.approx(truth.release, abs=2e-3)
    assert "release_s" in to_text(report) and json.loads(to_json(report))["signals"]


def test_the_band_of_a_command_line(params) -> None:
    assert not band_of(params).weighed
    band = band_of(params, mass=0.2, diameter=0.008)
    assert band.weighed and (band.params.mass, band.params.diameter) == (0.2, 0.008)
    assert band.params.rest_length == 0.52 and "assumed: --rest-length 0.52" in band.source
    assert band_of(params, diameter=0.008, rest_length=0.5).source == "given"
    with pytest.raises(UserError, match="--rest-length 0.2: must be longer"):
        band_of(params, rest_length=0.2)


def test_without_a_mass_nothing_is_judged_by_one(tmp_path, params) -> None:
    """A heavy band presses the hand down by half of its weight: no sensor is turned."""
    truth, mass = Truth(), 0.3
    weight = (HAND * SENSOR).inv().apply([0.0, 0.0, -9.81 * mass / 2])

    def heavy(stamp: int, message) -> None:
        if truth.holds((stamp - START) * 1e-9):
            force = message.wrench.force
            force.x, force.y, force.z = weight + [force.x, force.y, force.z]

    path = blind_bag(tmp_path, change=edit(wrench=heavy))
    for given, said in ((None, False), (mass, False), (0.03, True)):
        report = look_at(
            path, params, band_of(params, **({} if given is None else {"mass": given}))
        ).report
        assert ("direction" in abouts(report)) == said
        assert ("no mass given" in to_text(report)) == (given is None)


def test_outputs_are_refused_before_anything_is_read(tmp_path, params) -> None:
    missing = tmp_path / "missing.mcap"
    (tmp_path / "folder.png").mkdir()
    for options, words in (
        ({"sheet": tmp_path / "no" / "out.png"}, "there is no folder .*no, make it first"),
        ({"sheet": tmp_path / "folder.png"}, "is a folder"),
        ({"sheet": tmp_path / "out.jpg"}, "must end with .png"),
    ):
        with pytest.raises(UserError, match=words):
            checked(missing, params, band_of(params), **options)
    with pytest.raises(UserError, match="no such file"):
        checked(missing, params, band_of(params), sheet=tmp_path / "out.png")
    assert [p.name for p in tmp_path.iterdir()] == ["folder.png"]


def test_the_whole_command(fitted, tmp_path, monkeypatch) -> None:
    """By the settings of the lab: of a recording, and of a band's folder by its sizes."""
    monkeypatch.chdir(fitted)
    sheet, folder = tmp_path / "out.png", BandFolder.at(Path("bands/toy"))
    text, status = check(Path("seen.mcap"), {"mass": 0.03}, as_json=True, sheet=sheet)
    content = json.loads(text)
    assert status == 0 and content["usable"] and sheet.exists()
    assert str(sheet) in content["written"][0] and content["band"]["mass_kg"] == 0.03
    text, status = check_band(folder, {}, as_json=True)
    known = json.loads(text)["band"]
    assert known == content["band"] | {"source": "bands/toy/band.yaml"}


@pytest.mark.parametrize("name", MARKUP)
def test_a_name_of_any_letters_has_nothing_that_a_terminal_obeys(name: str) -> None:
    """Also where an error names what lies beside the recording."""
    problem, written = f"{name}.masks: there is no such folder", [f"{name}.png: six moments"]
    band = {"source": "given", "mass_kg": 0.03}
    report = new_report(Path(name), band) | {"problem": problem, "written": written}
    lines = to_text(report).split("\n")
    assert all(line.isprintable() for line in lines)
    shown = printable(name)
    assert f"cannot be used: {shown}.masks: there is no such folder" in lines
    assert f"{shown}.png: six moments" in lines
