"""`sling drift` on bands of our own simulator: one that keeps, and one that has softened."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from PIL import Image

from app.drift import recordings
from app.drift.change import ValueOfRecording
from app.drift.drift import BY_NAME, BY_TIME, SAME, anew, drift, shown
from app.drift.recordings import IdentifiedRecording, in_time
from pipeline.base.errors import UserError
from sling2sim2real import Band, Model, Settings, Theta, episode_from_arrays, rehearse
from tests.project import DEFAULTS

BAND = Band(0.023, 0.010, 0.52, "mine")
SECOND, DAY = 10**9, 86400 * 10**9
MAY = 1_777_800_000 * SECOND  # 3 May 2026


@pytest.fixture(scope="module")
def settings(delivered) -> Settings:
    sizes = {"mass": BAND.mass, "diameter": BAND.diameter, "rest_length": BAND.rest_length}
    return Settings.coarse(bands={"mine": {"source": "recording", **sizes}})


@pytest.fixture(scope="module")
def episodes(settings) -> dict:
    """Two of one band and one of it 15 % softer, each with noise of its own; by content of file."""
    by_content = {}
    for seed, (name, young) in enumerate({"a": 2.2e5, "b": 2.2e5, "soft": 1.87e5}.items()):
        theta = Theta(young, 0.47, 2.4e-3, 0.7, 0.6, mooney_share=0.3, relaxation=0.01)
        arrays = rehearse(Model(BAND, theta, settings=settings), seed=seed)
        by_content[name] = episode_from_arrays(**arrays, name="mine", settings=settings)
    return by_content


@pytest.fixture
def lab(tmp_path, settings, episodes, monkeypatch):
    """A project whose recordings hold their episode's name; `read` are those that were opened."""
    raw, begins, read = tmp_path / "data/raw/mine", {}, []
    raw.mkdir(parents=True)

    def read_mcap(path, band, settings):
        read.append(path.name)
        metadata = {"input": {"file": path.name, "start_ns": begins[path.name]}}
        return [replace(episodes[path.read_text()], metadata=metadata)]

    monkeypatch.setattr(recordings, "read_mcap", read_mcap)

    def put(file: str, content: str, begin: int) -> None:
        (raw / file).write_text(content)
        begins[file] = begin

    def run() -> dict:
        return drift(settings, "mine", tmp_path)

    return SimpleNamespace(put=put, read=read, root=tmp_path, drift=run)


def test_a_softened_band_is_told_and_one_that_keeps_is_not(lab) -> None:
    lab.put("z.mcap", "a", MAY)
    lab.put("y.mcap", "b", MAY + 7 * DAY)
    same = lab.drift()
    assert same["verdict"] == [SAME] and same["next"] is None and same["order"] == BY_TIME
    assert [row["file"] for row in same["recordings"]] == ["z.mcap", "y.mcap"]
    young = same["recordings"][0]["values"]["youngs_modulus"]
    assert young["low"] < 2.2e5 < young["high"]

    lab.put("x.mcap", "soft", MAY + 37 * DAY)
    lab.read.clear()
    content = lab.drift()
    assert lab.read == ["x.mcap"]  # the others are known
    assert content["recordings"][:2] == same["recordings"]
    (line,) = content["verdict"]
    assert line.startswith("E of mine changed: ") and line.endswith("; it softened")
    assert "kPa on 2026-05-" in line and "on 2026-06-09" in line
    change = content["changes"][0]
    assert (change["quantity"], change["later"]) == ("youngs_modulus", 2)
    assert change["ratio"] == pytest.approx(0.85, abs=0.03)
    assert [row["new"] for row in content["recordings"]] == [False, False, True]
    assert content["next"].endswith("data/raw/mine/x.mcap --mass 0.023 --name mine_new")

    folder = lab.root / "reports/drift"
    assert sorted(file.name for file in folder.iterdir()) == ["mine.json", "mine.png"]
    assert json.loads((folder / "mine.json").read_text()) == json.loads(json.dumps(content))
    with Image.open(folder / "mine.png") as image:
        assert min(image.size) > 500
    summary = shown(content).splitlines()
    assert summary[3].startswith("2026-06-09") and "x.mcap" in summary[3]
    assert summary[-2] == f"identify it anew with the newer recordings: {content['next']}"


def recorded(file: str, begin: int, end: int, deepest: float = 0.4) -> IdentifiedRecording:
    value = ValueOfRecording(value=1.0, low=0.9, high=1.1, deviation=0.06)
    values = dict.fromkeys(recordings.COMPARED, value)
    fields = {"key": file, "pulls": 1, "settled": True, "deepest": deepest, "values": values}
    return IdentifiedRecording(file=file, begin=begin, end=end, **fields)


def test_stamps_order_recordings_unless_they_are_a_simulations() -> None:
    first, second = recorded("b", MAY, MAY + SECOND), recorded("a", MAY + DAY, MAY + DAY + SECOND)
    assert in_time([second, first]) == [first, second]
    assert in_time([second, first, recorded("c", MAY, MAY + SECOND)]) is None
    assert in_time([recorded("a", 0, SECOND), recorded("b", 2 * SECOND, 3 * SECOND)]) is None


def files(root: Path, names: str) -> None:
    (root / "data/raw/mine").mkdir(parents=True, exist_ok=True)
    for name in names:
        (root / f"data/raw/mine/{name}.mcap").write_text(name)


def test_without_a_clock_names_decide(settings, tmp_path, monkeypatch) -> None:
    files(tmp_path, "ab")
    monkeypatch.setattr(recordings, "_alone", lambda file, *rest: recorded(file.name, 0, SECOND))
    content = drift(settings, "mine", tmp_path)
    assert content["order"] == BY_NAME
    assert "in the order of their names" in shown(content)
    assert [row["date"] for row in content["recordings"]] == [None, None]


def test_what_had_not_settled_is_left_out(settings, tmp_path, monkeypatch, capsys) -> None:
    soft = ValueOfRecording(value=0.5, low=0.49, high=0.51, deviation=0.01)
    message = {
        "a": recorded("a.mcap", MAY, MAY + SECOND),
        "b": recorded("b.mcap", MAY + DAY, MAY + DAY + SECOND).model_copy(
            update={"settled": False, "values": dict.fromkeys(recordings.COMPARED, soft)}
        ),
        "c": recorded("c.mcap", MAY + 2 * DAY, MAY + 2 * DAY + SECOND),
    }
    files(tmp_path, "abc")
    monkeypatch.setattr(recordings, "_alone", lambda file, *rest: message[file.stem])
    content = drift(settings, "mine", tmp_path)
    assert content["verdict"] == [SAME]
    assert "b.mcap had not settled" in capsys.readouterr().err
    assert "not settled, left out" in shown(content).splitlines()[2]
    (tmp_path / "data/raw/mine/c.mcap").unlink()
    with pytest.raises(UserError, match="fewer than two"):
        drift(settings, "mine", tmp_path)


def test_a_recording_that_stretched_it_further_is_a_change(settings, tmp_path, monkeypatch) -> None:
    """Values alone are the same; 2 mm further are no news."""
    depths = {"a": 0.40, "b": 0.402, "c": 0.44, "d": 0.43}
    message = {
        name: recorded(f"{name}.mcap", MAY + i * DAY, MAY + i * DAY + SECOND, depth)
        for i, (name, depth) in enumerate(depths.items())
    }
    monkeypatch.setattr(recordings, "_alone", lambda file, *rest: message[file.stem])
    files(tmp_path, "ab")
    assert drift(settings, "mine", tmp_path)["verdict"] == [SAME]
    files(tmp_path, "cd")
    content = drift(settings, "mine", tmp_path)
    (line,) = content["verdict"]
    assert line.startswith("c.mcap draws mine to 0.440 m, recordings before it to 0.402 m at most")
    assert content["stretched_further"] == [{"later": 2, "before_m": 0.402}]
    assert content["changes"] == []
    assert [row["new"] for row in content["recordings"]] == [False, False, True, True]
    assert content["next"].split()[2:4] == [f"{tmp_path}/data/raw/mine/{x}.mcap" for x in "cd"]
    for before, silent in ((0.42, False), (0.438, True), (True, True)):
        sizes = settings.bands["mine"].model_dump() | {"preconditioned": before}
        params = settings.changed(bands={"mine": sizes})
        assert (drift(params, "mine", tmp_path)["verdict"] == [SAME]) == silent


def test_the_command_names_sizes_that_are_not_the_usual_ones() -> None:
    assert anew(BAND, []) == "sling fit --mass 0.023 --name mine_new"
    other = replace(BAND, diameter=0.008, rest_length=0.5)
    assert "--diameter 0.008 --rest-length 0.5" in anew(other, [])


def test_a_mistake_is_one_line(tmp_path, sling) -> None:
    (tmp_path / "params.yaml").write_text(DEFAULTS.read_text())

    def summary(band: str) -> str:
        done = sling("drift", "--band", band, folder=tmp_path)
        assert done.returncode == 1 and done.stdout == ""
        (line,) = (text for text in done.stderr.splitlines() if not text.endswith(" ..."))
        return line

    assert summary("none").startswith("error: band none: not in params.yaml")
    assert "holds no recording, two or more are needed" in summary("band1")
    (tmp_path / "data/raw/band1").mkdir(parents=True)
    (tmp_path / "data/raw/band1/band1.mcap").write_bytes(b"x")
    assert "holds one recording" in summary("band1")
    assert not (tmp_path / "reports").exists()
    (tmp_path / "data/raw/band1/band1_2.mcap").write_bytes(b"no recording")
    assert summary("band1").startswith("error: data/raw/band1/band1.mcap: ")
    assert not (tmp_path / "reports").exists()
