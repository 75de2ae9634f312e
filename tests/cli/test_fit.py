"""`sling fit`: what a band's folder holds, what makes it anew, and that nothing harms it."""

import json
import os
import re
import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.layout import Layout
from pipeline.params.run import Pair
from sling2sim2real import Identification, UserError
from sling2sim2real.api.band_folder import BandFile, BandFolder
from sling2sim2real.base.launches_file import write_launches
from sling2sim2real.cli import fit as module
from sling2sim2real.cli.fit import fit, folder_of, shown
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.recording import build
from tests.cli.lab import LAB, MASS, NAME, furnish
from tests.project import contents, write_params_of

TOY = Path("bands", NAME)
WHOLE = {"band.yaml", "recordings", "episodes", "start.json", "theta.json", "card"}
METHOD = module.METHOD


@pytest.fixture
def no_recording_is_read(monkeypatch) -> None:
    def fail(*given):
        raise AssertionError("the recording is read again")

    monkeypatch.setattr(build, "build_episodes", fail)
    monkeypatch.setattr("sling2sim2real.card.camera.read_recording", fail)


def test_the_folder_is_whole(fitted: Path) -> None:
    folder = fitted / TOY
    assert {path.name for path in folder.iterdir()} == WHOLE
    assert (folder / "recordings/seen.mcap").samefile(fitted / "seen.mcap")  # a hard link
    file = BandFile.load(folder / "band.yaml")
    assert file.sizes == {"mass": MASS, "diameter": 0.010, "rest_length": 0.52}
    assert file.assumed == ("diameter", "rest_length")
    card = json.loads((folder / "card/card.json").read_text())
    assert card["band"] == NAME and card["sizes"] == file.sizes
    text = (folder / "card/README.md").read_text()
    assert "**assumed, not measured: diameter, rest length**" in text and "0.03 kg" in text
    assert not [*fitted.rglob("*.tmp")] and not (fitted / "logs").exists()


def test_the_same_command_again_changes_nothing(copied, no_recording_is_read) -> None:
    before = contents(copied)
    times = {path: path.stat().st_mtime_ns for path in copied.rglob("*") if path.is_file()}
    folder, recordings = folder_of([Path("seen.mcap")], NAME)
    card = fit(folder, recordings, {})
    assert card["card"] == str(TOY / "card/README.md") and card["verdict"]
    assert contents(copied) == before
    assert times == {path: path.stat().st_mtime_ns for path in times}


def test_launches_are_learned_from_or_held_against(copied, no_recording_is_read) -> None:
    """Without a look at the recording; and one to check moves no θ."""
    before = Identification.load(TOY)
    (TOY / "launches.csv").write_text("draw_y,draw_z,landing,use\n-0.3,-0.15,2.0,check\n")
    assert Identification.load(TOY).stale
    fit(BandFolder(TOY))
    checked = Identification.load(TOY)
    assert not checked.stale and checked.theta == before.theta
    assert "- Launches that check the predictions: 1 measured." in (
        (TOY / "card/README.md").read_text()
    )
    (TOY / "launches.csv").write_text("draw_y,draw_z,landing\n-0.3,-0.15,2.0\n")
    card = fit(BandFolder(TOY))
    after = Identification.load(TOY)
    assert card["launches"] == 1 and after.theta != before.theta
    assert after.mounting == before.mounting
    (TOY / "launches.csv").unlink()  # undone
    fit(BandFolder(TOY))
    again = Identification.load(TOY)
    assert again.theta == before.theta and np.array_equal(again.samples, before.samples)


def test_another_size_is_a_new_fit_of_a_known_band(copied) -> None:
    old = {path.name for path in (TOY / "episodes").iterdir()}
    fit(BandFolder(TOY), [], {"diameter": 0.011})
    file = BandFile.load(TOY / "band.yaml")
    assert file.sizes["diameter"] == 0.011 and file.assumed == ("rest_length",)
    assert Identification.load(TOY).band.diameter == 0.011
    new = {path.name for path in (TOY / "episodes").iterdir()}
    assert len(new) == 1 and not new & old  # what nothing needs any more is thrown away


def test_what_a_band_changes_of_the_lab_holds_for_it(copied) -> None:
    file = BandFile.load(TOY / "band.yaml")
    other = {"trials": {"targets": [1.8]}}
    BandFile(**file.sizes, settings=other).save(TOY / "band.yaml")
    card = fit(BandFolder(TOY))
    assert [draw["target_m"] for draw in card["draws"]] == [1.8]
    assert card["assumed"] == []


@pytest.mark.slow
def test_theta_is_that_of_the_experiment(fitted, tmp_path, monkeypatch) -> None:
    """To the digit: the stages of a run, on the same recording with the same settings."""
    write_params_of(tmp_path, NAME, METHOD, MASS, **LAB)
    layout, pair = Layout(tmp_path), Pair(band=NAME, recording="plain", method=METHOD)
    layout.raw(pair).mkdir(parents=True)
    shutil.copy(fitted / "seen.mcap", layout.raw(pair))
    write_launches(layout.launches(NAME), [])
    monkeypatch.chdir(tmp_path)
    for stage in ("episode", "clamps", "history", "posterior", "theta"):
        key = pair.of_recording if stage in ("episode", "clamps") else pair.key
        monkeypatch.setattr(sys, "argv", ["stage", key])
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(f"stages.{stage}", run_name="__main__")
        assert not ended.value.code
    found = Identification.load(fitted / TOY)
    content = load_theta(layout.theta(pair), NAME)
    mine = found.content()
    assert mine["theta"] == content["theta"]
    assert mine["confidence"] == content["confidence"]
    samples = json.loads(layout.confidence(pair).read_text())["samples"]
    assert found.samples.tolist() == samples


@pytest.mark.slow
def test_killed_at_any_moment_the_same_command_goes_on(fitted, tmp_path, monkeypatch) -> None:
    """After each rename in turn; in the end the folder is what it would have been."""
    furnish(tmp_path)
    shutil.copy2(fitted / "seen.mcap", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(build, "build_episodes", _built_once())
    replace, left = os.replace, [0]

    def dying(source, target) -> None:
        replace(source, target)
        left[0] -= 1
        if left[0] == 0:
            raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", dying)
    for survived in range(1, 100):
        left[0] = survived
        folder, recordings = folder_of([Path("seen.mcap")], NAME)
        try:
            fit(folder, recordings, {"mass": MASS})
        except KeyboardInterrupt:
            if (TOY / "band.yaml").is_file():
                BandFile.load(TOY / "band.yaml")
            if (TOY / "theta.json").is_file():
                Identification.load(TOY)
            continue
        break
    assert survived > 5
    mine, theirs = contents(tmp_path / TOY), contents(fitted / TOY)
    assert mine.keys() == theirs.keys()
    assert [name for name in mine if mine[name] != theirs[name]] == []


def _built_once():
    """Builds the episodes, which takes the longest, once."""
    built, made = build.build_episodes, []

    def build_episodes(path, name, settings):
        if not made:
            made.append(built(path, name, settings))
        return made[0]

    return build_episodes


@pytest.mark.parametrize(
    ("given", "name", "sizes", "message"),
    [
        (["seen.mcap"], None, {}, "seen: is new; weigh the band and give --mass KG"),
        (["seen.mcap"], "Big", {"mass": 0.04}, "use small letters"),
        (["2026.mcap"], None, {"mass": 0.04}, "makes no band name; give one: --name NAME"),
        (["notes.mcap"], "s", {"mass": 0.04}, "notes.mcap"),
        (["bands/s"], None, {}, "bands/s: no such file"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_is_written(
    fitted, tmp_path, monkeypatch, given, name, sizes, message
) -> None:
    for file in ("seen.mcap", "2026.mcap"):
        os.link(fitted / "seen.mcap", tmp_path / file)
    (tmp_path / "notes.mcap").write_text("no recording")
    monkeypatch.chdir(tmp_path)
    before = contents(tmp_path)
    with pytest.raises(UserError, match=re.escape(message)):
        folder, recordings = folder_of([Path(path) for path in given], name)
        fit(folder, recordings, sizes)
    assert contents(tmp_path) == before and not (tmp_path / "bands").exists()


def test_a_known_band_is_added_to_on_purpose_alone(copied) -> None:
    (copied / "toy.mcap").write_bytes((copied / "seen.mcap").read_bytes() + b"\0")
    with pytest.raises(UserError, match="bands/toy: is there already; to add to it, --name toy"):
        folder_of([Path("toy.mcap")], None)
    (copied / "other").mkdir()
    shutil.copy(copied / "toy.mcap", copied / "other/seen.mcap")
    with pytest.raises(UserError, match="seen.mcap: is another recording; give"):
        fit(BandFolder(TOY), [Path("other/seen.mcap")], {})
    with pytest.raises(UserError, match="are the same recording"):
        fit(BandFolder(TOY), [Path("toy.mcap"), Path("other/seen.mcap")], {})
    with pytest.raises(UserError, match="give one band"):
        folder_of([TOY], "other")


def test_a_mistake_in_a_file_is_named_by_the_file(copied) -> None:
    for path, text, words in (
        ("bands/lab.yaml", "setup: {fork_widht: 0.3}\n", "lab.yaml: setup.fork_widht: unknown key"),
        ("bands/lab.yaml", "setup: [\n", "lab.yaml, line 2: not valid YAML"),
        ("bands/toy/band.yaml", "mass: 0.03\n", "band.yaml: diameter: is missing"),
        (
            "bands/toy/band.yaml",
            "mas: 0.03\n",
            "band.yaml: mas: unknown key, the closest",
        ),
        (
            "bands/toy/band.yaml",
            "{mass: 30, diameter: 0.01, rest_length: 0.5}\n",
            "band.yaml: mass: must be between",
        ),
    ):
        file = copied / path
        before = file.read_bytes() if file.exists() else None
        file.write_text(text)
        with pytest.raises(UserError) as caught:
            fit(BandFolder(TOY))
        assert words in str(caught.value) and "\n" not in str(caught.value)
        file.write_bytes(before) if before is not None else file.unlink()


CARD = {
    "band": "mine",
    "verdict": "with care",
    "reasons": ["It is not settled."],
    "draws": [
        {"target_m": 1.725, "draw_y_m": -0.3, "draw_z_m": -0.15, "predicted_landing_m": 1.726}
        | {"interval_90_m": [1.6, 1.9], "hold_force_n": 9.06},
        {"target_m": 2.1, "draw_y_m": -0.4, "draw_z_m": -0.2, "predicted_landing_m": None}
        | {"interval_90_m": None, "hold_force_n": None},
    ],
    "next": ["Measure a launch."],
}


def test_the_screen() -> None:
    text = shown(CARD | {"card": "bands/mine/card/README.md"})
    for words in (
        "mine: with care\n  - It is not settled.\n",
        "fails in simulation",
        "Card: bands/mine/card/README.md\nPage: file:///",
    ):
        assert words in text
    assert any("1.725" in line and line.endswith("9.1") for line in text.splitlines())
