"""Masks beside a recording: found by check, copied with it, asked for by --pictures."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from sling2sim2real.api.band_folder import BandFile, BandFolder, write_yaml
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli import fit
from sling2sim2real.cli.preflight.command import checked
from tests.cli.lab import LAB
from tests.cli.preflight.conftest import band_of
from tests.project import contents, with_
from tests.recording.parts import joined
from validation.recordings.bag import Truth, blind_bag

COLOR = "/camera/color/compressed"


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder of `cloud.mask: folder`."""
    write_yaml(tmp_path / "bands/lab.yaml", LAB | {"cloud": {"mask": "folder"}}, "A lab")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def mine(masked, tmp_path_factory) -> Path:
    """A recording with masks, and with what else may lie in such a folder."""
    folder = tmp_path_factory.mktemp("mine")
    shutil.copytree(masked.parent, folder, dirs_exist_ok=True)
    masks = folder / "masked.masks"
    for name in ("notes.txt", ".png", "-1.png", "1.png.tmp", "..png", "1.PNG"):
        (masks / name).write_text("no mask")
    (masks / "7.png").mkdir()
    (masks / "8.png").symlink_to("../../none")
    return folder / "masked.mcap"


def masks(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_check_uses_the_masks_beside_the_recording(masked, seen, params, tmp_path) -> None:
    chosen = with_(params, "cloud", mask="folder")
    content = json.loads(
        checked(masked, chosen, band_of(chosen), as_json=True, sheet=tmp_path / "a.png")[0]
    )
    usual = json.loads(checked(masked, params, band_of(params), as_json=True)[0])
    assert content["problem"] is None and (tmp_path / "a.png").is_file()
    summary = usual["cloud"].pop("told_by_color"), content["cloud"].pop("told_by_color")
    assert summary == (True, False) and content["cloud"] == usual["cloud"]
    text, status = checked(seen[0], chosen, band_of(chosen))
    assert status == 1 and "there is no such folder of masks" in text


def test_masks_alone_come_with_their_recording_and_better_ones_after_it(lab, masked, mine) -> None:
    there = lab / "bands/red/recordings"

    def bring(recording: Path) -> dict[str, bytes]:
        folder = BandFolder.named("red")
        file = BandFile(mass=0.0408, diameter=0.010, rest_length=0.52)
        steps = fit.Steps(fit.COSTS)
        fit._bring_in(folder, file, folder.settings_with(file), [recording], steps)
        return masks(there / "masked.masks")

    lost = next((mine.parent / "masked.masks").glob("1*0.png"))
    retained = lost.read_bytes()
    lost.unlink()
    with pytest.raises(UserError, match="masks of 1 of 54 pictures are missing"):
        bring(mine)
    assert not (lab / "bands/red").exists()
    lost.write_bytes(retained)
    first = bring(mine)
    assert first == masks(masked.with_suffix(".masks"))
    assert sorted(file.name for file in there.iterdir()) == ["masked.masks", "masked.mcap"]

    name = sorted(first)[0]
    black = cv2.imencode(".png", np.zeros((240, 320), np.uint8))[1].tobytes()
    assert first[name] != black
    before = BandFolder.named("red").episodes(there / "masked.mcap")
    (mine.parent / "masked.masks" / name).write_bytes(black)
    assert bring(mine) == first | {name: black}
    assert BandFolder.named("red").episodes(there / "masked.mcap") != before  # they are made anew
    assert bring(there / "masked.mcap") == first | {name: black}  # the copy itself
    shutil.rmtree(mine.parent / "masked.masks")
    assert bring(mine) == first | {name: black}  # none are given: those that are there stay


def test_pictures_are_those_to_mask_by_their_names(blind, seen, masked, params, tmp_path) -> None:
    """Against another reader: every name is a header's stamp, and the pixels are its picture's."""
    text, status = checked(seen[0], params, band_of(params), pictures=tmp_path / "to_mask")
    assert status == 0 and f"{tmp_path / 'to_mask'}: 54 pictures to mask" in text
    written = masks(tmp_path / "to_mask")
    assert written.keys() == masks(masked.with_suffix(".masks")).keys()
    count = 0
    reader = make_reader(seen[0].open("rb"), decoder_factories=[DecoderFactory()])
    for _, _, _, message in reader.iter_decoded_messages(topics=[COLOR]):
        stamp = message.header.stamp
        if packed := written.get(f"{stamp.sec * 10**9 + stamp.nanosec}.png"):
            count += 1
            theirs, ours = (
                cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
                for data in (message.data, packed)
            )
            np.testing.assert_array_equal(ours, theirs)
    assert count == 54
    by_folder = with_(params, "cloud", mask="folder")
    text, status = checked(blind[0], by_folder, band_of(by_folder), pictures=tmp_path / "b")
    assert status == 1 and "no such folder of masks" in text  # pictures come before masks
    assert "pictures to mask" in text and len(masks(tmp_path / "b")) == 54


def test_pictures_of_every_pull(seen, params, tmp_path) -> None:
    joined(tmp_path / "two.mcap", [seen[0], seen[0]])
    checked(tmp_path / "two.mcap", params, band_of(params), pictures=tmp_path / "both")
    assert len(masks(tmp_path / "both")) == 108


@pytest.mark.parametrize(
    ("name", "words"),
    [("there", "is there already"), ("none/new", "there is no folder"), ("file", "is there")],
)
def test_pictures_go_to_a_new_folder(seen, params, tmp_path, name, words) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "mine.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    before = contents(tmp_path)
    with pytest.raises(UserError, match=words):
        checked(seen[0], params, band_of(params), pictures=tmp_path / name)
    assert contents(tmp_path) == before


def test_nothing_is_written_of_a_recording_that_is_not_understood(params, tmp_path) -> None:
    path = blind_bag(tmp_path, Truth(stiffness=0.0))
    text, status = checked(path, params, band_of(params), pictures=tmp_path / "new")
    assert status == 1 and "was not written: no pull is understood" in text
    assert not (tmp_path / "new").exists()
