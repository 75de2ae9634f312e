"""SAM 3 with random weights: what is made of its answers, not how good they are.

The model is the real one of transformers, with few and narrow layers.
"""

from __future__ import annotations

import shutil
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.recording.masks import masker
from validation.recordings import looks
from validation.recordings.looks import LOOKS
from validation.recordings.tiny_sam3 import save_tiny_sam3

pytest.importorskip("transformers", reason="sam3 is an extra")


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sam3")
    save_tiny_sam3(folder)
    return folder


def settings(folder, **changes) -> SimpleNamespace:
    given = {"weights": str(folder), "prompt": "rubber band", "device": "cpu"}
    return SimpleNamespace(**given | changes)


@pytest.fixture(scope="module")
def view():
    return looks.view_of(LOOKS["orange on grey, white arm"], looks.times(4))[0]


def test_masks_are_what_the_model_sees_where_the_band_can_be(weights, view) -> None:
    mask = masker("sam3", view, settings(weights))
    again = masker("sam3", view, settings(weights))
    for number, frame in view.frames():
        pixels = mask.mask(frame)
        assert pixels.shape == frame.depth.shape and pixels.dtype == bool
        assert not (pixels & ~frame.near).any()
        np.testing.assert_array_equal(pixels, again.mask(frame))
        # Pixel by pixel: the model's picture, stretched over the colour picture, above 0.
        logits = mask.logits[number]
        assert logits.shape == (32, 32)
        high, low = np.full_like(logits, 5), np.full_like(logits, -5)
        mask.logits[number] = high
        np.testing.assert_array_equal(mask.mask(frame), frame.near)
        mask.logits[number] = low
        assert not mask.mask(frame).any()
        low[:, :16] = 5  # the left half of the colour picture
        whole = np.zeros((480, 640), bool)
        whole[:, :320] = True
        np.testing.assert_array_equal(mask.mask(frame), whole[view.window] & frame.near)
        mask.logits[number] = logits


def test_masks_are_warped_to_a_depth_camera_of_its_own(weights) -> None:
    """The model sees the band's own pixels of the colour picture: these become the mask."""
    view, truths = looks.view_of(LOOKS["orange, colour camera apart"], looks.times(4))
    mask = masker("sam3", view, settings(weights))
    hits = wrong = 0
    for number, frame in view.frames():
        color = view.color(number).astype(int)
        orange = (color[..., 2] - color[..., 0] > 50).astype(np.float32)
        mask.logits[number] = orange * 10 - 5
        pixels = mask.mask(frame)
        band = truths[number].part[view.window] == looks.BAND
        band &= np.abs(frame.depth - truths[number].depth[view.window]) < 0.005
        hits += (pixels & band).sum() / band.sum() / len(view)
        wrong += (pixels & ~band & (frame.depth > 0)).sum() / max(1, pixels.sum()) / len(view)
    assert hits > 0.8
    assert wrong < 0.2  # edges: the extrinsics are off by a millimetre, JPEG blurs colours


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda folder: shutil.rmtree(folder), "no such folder"),
        (lambda folder: (folder / "config.json").unlink(), "config.json is missing"),
        (lambda folder: (folder / "tokenizer.json").unlink(), "tokenizer.json is missing"),
        (lambda folder: (folder / "model.safetensors").unlink(), "model.safetensors is missing"),
        (lambda folder: (folder / "model.safetensors").write_bytes(b"x" * 99), "cannot be loaded"),
        (lambda folder: (folder / "config.json").write_text("{"), "damaged"),
        (lambda folder: (folder / "config.json").write_text('{"model_type": "sam2"}'), "sam2"),
        (lambda folder: _drop_a_weight(folder), "incomplete, 1 weights such as"),
    ],
)
def test_folders_that_cannot_be_used(spoil, words, weights, view, tmp_path) -> None:
    folder = tmp_path / "sam3"
    shutil.copytree(weights, folder)
    spoil(folder)
    with pytest.raises(UserError, match=words) as caught:
        masker("sam3", view, settings(folder))
    assert "\n" not in str(caught.value) and str(folder) in str(caught.value)


def _drop_a_weight(folder) -> None:
    from safetensors.numpy import load_file, save_file

    retained = load_file(folder / "model.safetensors")
    retained.pop(sorted(retained)[0])
    save_file(retained, folder / "model.safetensors", metadata={"format": "pt"})


def test_a_device_that_is_not_there(weights, view) -> None:
    with pytest.raises(UserError, match="cuda:77: there is no such GPU"):
        masker("sam3", view, settings(weights, device="cuda:77"))


def test_without_transformers(weights, view, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(UserError, match=r"transformers is not installed.*\[sam3\]"):
        masker("sam3", view, settings(weights))
