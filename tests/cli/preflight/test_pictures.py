"""The sheet and the timeline, read back by others than those who wrote them."""

import re
import subprocess
import sys

import cv2
import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.preflight.check import Look
from sling2sim2real.cli.preflight.facts import BandFacts
from sling2sim2real.cli.preflight.report import CheckReport
from sling2sim2real.cli.preflight.sheet import MOMENTS, draw_sheet, masked_frames, moments
from sling2sim2real.cli.preflight.timeline import write_timeline


@pytest.fixture
def with_rerun() -> None:
    pytest.importorskip("rerun", reason="rerun-sdk: pip install -e '.[view]'")


def test_the_sheet_shows_six_moments(looked, params, tmp_path) -> None:
    path = tmp_path / "sheet.png"
    assert str(path) in draw_sheet(looked, params, path)
    image = cv2.imread(str(path))
    assert image.shape[1] == 1600
    blue, green, red = image[: image.shape[0] // 4].astype(int).transpose(2, 0, 1)
    outline = np.minimum(blue, red) > green + 50  # towards the colour of the mask
    columns = np.array_split(outline, len(MOMENTS), axis=1)
    assert all(column.sum() > 50 for column in columns)
    assert [p.name for p in tmp_path.iterdir()] == ["sheet.png"]


def test_moments_follow_the_events(looked) -> None:
    scene, when = looked.done.scene, moments(looked.done.scene)
    assert list(when) == list(MOMENTS) and sorted(when.values()) == list(when.values())
    assert not scene.holds(when["hanging"]) and scene.holds(when["grasp"])
    assert (
        not scene.taut(when["lift"]) and scene.taut(when["mid pull"]) and scene.taut(when["held"])
    )
    assert not scene.holds(when["recoil"])


def test_masks_are_those_of_the_clouds(looked, params) -> None:
    counts = [int(mask.sum()) for _, mask in masked_frames(looked.done, params.cloud)]
    assert counts == looked.done.clouds.pixels.tolist()


def test_a_refused_recording_shows_what_it_has(with_rerun, refused, params, tmp_path) -> None:
    assert not refused.report.usable
    message = draw_sheet(refused, params, tmp_path / "sheet.png")
    assert "all that can be shown" in message
    assert cv2.imread(str(tmp_path / "sheet.png")).shape[1] == 1600
    message = write_timeline(refused, params, tmp_path / "out.rrd")
    assert "all that can be shown" in message
    assert "/raw_force/x" in entities(tmp_path / "out.rrd")


def test_nothing_to_show_is_said(with_rerun, params, tmp_path) -> None:
    look = Look(
        CheckReport("x.mcap", "", "no force", [], [], band=BandFacts(0.01, 0.5, "given", 0.03))
    )
    for function, name in ((draw_sheet, "a.png"), (write_timeline, "a.rrd")):
        assert "nothing in the recording" in function(look, params, tmp_path / name)
    assert not list(tmp_path.iterdir())


def rerun(*arguments: object) -> str:
    """Rerun's own reader, a program of its own."""
    command = [sys.executable, "-m", "rerun", "rrd", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def entities(path) -> dict[str, int]:
    """Chunks by entity."""
    return {
        name: int(count)
        for name, count in re.findall(r"^(/\S+): (\d+)$", rerun("stats", path), re.MULTILINE)
    }


def test_the_timeline_is_read_by_rerun(with_rerun, looked, params, tmp_path) -> None:
    path = tmp_path / "out.rrd"
    assert str(path) in write_timeline(looked, params, path)
    assert path.stat().st_size < 3 * looked.recording.path.stat().st_size
    rerun("verify", path)
    paths = set(entities(path))
    pictures = {"/fork/color/picture", "/fork/color/mask", "/fork/depth/picture"}
    motion = {"/fork/cloud", "/fork/hand", "/fork/hand/force", "/force/y", "/position/z", "/speed"}
    assert {*pictures, *motion, "/fork/tips", "/coverage", "/report", "/events"} <= paths

    events = rerun("print", "-vvv", "--entity", "/events", path)
    times = dict(re.findall(r"PT([0-9.]+)S.*\[(grasp|release)\]", events))
    times = {name: float(seconds) for seconds, name in times.items()}
    signals = looked.report.signals
    assert times["release"] == pytest.approx(signals.release_s, abs=1e-6)
    assert times["grasp"] == pytest.approx(signals.grasp_s, abs=1e-6)
    rows = rerun("print", "-vvv", "--entity", "/force/y", path)
    values = [float(x) for x in re.findall(r"PT[0-9.]+S.*\[(-?[0-9.e-]+)\]", rows)]
    np.testing.assert_allclose(values, looked.done.signals.force[:, 1], atol=1e-9)


def test_without_rerun_one_line_says_so(looked, params, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UserError, match=r"pip install -e '\.\[view\]'"):
        write_timeline(looked, params, tmp_path / "out.rrd")
    assert not list(tmp_path.iterdir())
