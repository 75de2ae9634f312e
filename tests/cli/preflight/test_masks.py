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
from sling2sim2real.cli.preflight.recordings import add_recording

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.fit import fit
from sling2sim2real.cli.preflight.command import check
from tests.cli.preflight.test_add_band import add
from tests.project import contents, with_
from tests.recording.parts import joined
from validation.recordings.bag import Truth, blind_bag

COLOR = "/camera/color/compressed"


@pytest.fixture
def by_folder(project: Path) -> Path:
    """A project of `cloud.mask: folder`."""
    path = project / "params.yaml"
    text = path.read_text()
    assert "mask: opencv" in text
    path.write_text(text.replace("mask: opencv", "mask: folder"))
    return project


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
    content = json.loads(check(masked, chosen, as_json=True, sheet=tmp_path / "a.png")[0])
    usual = json.loads(check(masked, params, as_json=True)[0])
    assert content["problem"] is None and (tmp_path / "a.png").is_file()
    summary = usual["cloud"].pop("told_by_color"), content["cloud"].pop("told_by_color")
    assert summary == (True, False) and content["cloud"] == usual["cloud"]
    text, status = check(seen[0], chosen)
    assert status == 1 and "there is no such folder of masks" in text


def test_masks_alone_are_copied_with_their_recording(by_folder, masked, mine) -> None:
    before = (by_folder / "params.yaml").read_bytes()
    lost = next((mine.parent / "masked.masks").glob("1*0.png"))
    retained = lost.read_bytes()
    lost.unlink()
    with pytest.raises(UserError, match="masks of 1 of 54 pictures are missing"):
        add(by_folder, mine)
    assert contents(by_folder) == {Path("params.yaml"): before}
    lost.write_bytes(retained)
    add(by_folder, mine)
    assert masks(by_folder / "data/raw/red/masked.masks") == masks(masked.with_suffix(".masks"))
    assert sorted(file.name for file in (by_folder / "data/raw/red").iterdir()) == [
        "masked.masks",
        "masked.mcap",
    ]


def test_a_further_recording_brings_its_masks(project, by_folder, masked, tmp_path) -> None:
    add(project, masked)
    more = tmp_path / "more.mcap"
    joined(more, [masked, masked])  # other bytes, and the first pull's stamps are the same
    shutil.copytree(masked.with_suffix(".masks"), tmp_path / "more.masks")
    output = add_recording("red", [more], project)
    assert "1 pull" in output and "pull 2: left out" in output
    assert masks(project / "data/raw/red/more.masks") == masks(tmp_path / "more.masks")


def test_fit_brings_better_masks_of_a_recording_that_is_there(
    by_folder, mine, tmp_path_factory, monkeypatch
) -> None:
    def repro(root, *_, **__) -> None:
        card = root / "reports/bands/red"
        card.mkdir(parents=True, exist_ok=True)
        (card / "card.json").write_text("{}")

    monkeypatch.setattr(fit, "repro", repro)

    def run(recording: Path) -> dict[str, bytes]:
        fit.fit([recording], "red", fit.NewBand(mass=0.0408), root=by_folder)
        return masks(there)

    there = by_folder / "data/raw/red/masked.masks"
    first = run(mine)
    name = sorted(first)[0]
    black = cv2.imencode(".png", np.zeros((240, 320), np.uint8))[1].tobytes()
    assert first[name] != black
    (mine.parent / "masked.masks" / name).write_bytes(black)
    assert run(mine) == first | {name: black}
    assert run(there.with_suffix(".mcap")) == first | {name: black}  # the copy itself
    shutil.rmtree(mine.parent / "masked.masks")
    assert run(mine) == first | {name: black}  # none are given: those that are there stay


def test_pictures_are_those_to_mask_by_their_names(blind, seen, masked, params, tmp_path) -> None:
    """Against another reader: every name is a header's stamp, and the pixels are its picture's."""
    text, status = check(seen[0], params, pictures=tmp_path / "to_mask")
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
    text, status = check(blind[0], by_folder, pictures=tmp_path / "b")
    assert status == 1 and "no such folder of masks" in text  # pictures come before masks
    assert "pictures to mask" in text and len(masks(tmp_path / "b")) == 54


def test_pictures_of_every_pull(seen, params, tmp_path) -> None:
    joined(tmp_path / "two.mcap", [seen[0], seen[0]])
    check(tmp_path / "two.mcap", params, pictures=tmp_path / "both")
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
        check(seen[0], params, pictures=tmp_path / name)
    assert contents(tmp_path) == before


def test_nothing_is_written_of_a_recording_that_is_not_understood(params, tmp_path) -> None:
    path = blind_bag(tmp_path, Truth(stiffness=0.0))
    text, status = check(path, params, pictures=tmp_path / "new")
    assert status == 1 and "was not written: no pull is understood" in text
    assert not (tmp_path / "new").exists()
