"""SAM 3 with random weights: what is made of its answers, not how good they are.

The model is the real one of transformers, with few and narrow layers.
"""

from __future__ import annotations

import shutil
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.errors import UserError
from pipeline.recording.masks import masker
from tests.recording import looks
from tests.recording.looks import LOOKS

pytest.importorskip("transformers", reason="sam3 is an extra")
WIDTH, IMAGE = 128, 112


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A folder as a user would have it, of a model that finds something by any prompt."""
    import torch
    from transformers import CLIPTokenizer, Sam3VideoConfig, Sam3VideoModel

    folder = tmp_path_factory.mktemp("sam3")
    heads = {"num_attention_heads": 2, "intermediate_size": 64}
    vision = {
        "backbone_config": {
            **heads,
            "model_type": "sam3_vit_model",
            "hidden_size": 32,
            "num_hidden_layers": 2,
            "image_size": IMAGE,
            "pretrain_image_size": IMAGE,
            "patch_size": 14,
            "window_size": 4,
            "global_attn_indexes": [1],
        },
        "fpn_hidden_size": WIDTH,
        "backbone_feature_sizes": [[32, 32], [16, 16], [8, 8]],
    }
    detector = {
        "vision_config": vision,
        "text_config": {**heads, "hidden_size": 32, "num_hidden_layers": 1, "projection_dim": 32},
        "geometry_encoder_config": {**heads, "hidden_size": WIDTH, "num_layers": 1},
        "detr_encoder_config": {**heads, "hidden_size": WIDTH, "num_layers": 1},
        "detr_decoder_config": {**heads, "hidden_size": WIDTH, "num_layers": 1, "num_queries": 8},
        "mask_decoder_config": {"hidden_size": WIDTH, "num_attention_heads": 2},
    }
    tracker = {
        "vision_config": vision,
        "prompt_encoder_config": {"hidden_size": WIDTH, "image_size": IMAGE, "patch_size": 14},
        "mask_decoder_config": {
            "hidden_size": WIDTH,
            "mlp_dim": 64,
            "num_attention_heads": 2,
            "iou_head_hidden_dim": 32,
        },
        "memory_attention_hidden_size": WIDTH,
        "memory_attention_num_layers": 1,
        "memory_attention_feed_forward_hidden_size": 64,
        "memory_attention_rope_feat_sizes": [8, 8],
        "memory_encoder_hidden_size": WIDTH,
        "memory_encoder_output_channels": 64,
        "mask_downsampler_embed_dim": WIDTH,
        "memory_fuser_embed_dim": WIDTH,
        "memory_fuser_intermediate_dim": 64,
        "image_size": IMAGE,
    }
    torch.manual_seed(0)
    config = Sam3VideoConfig(
        detector_config=detector,
        tracker_config=tracker,
        low_res_mask_size=32,
        score_threshold_detection=0.0,
        new_det_thresh=0.0,
    )
    Sam3VideoModel(config).save_pretrained(folder)
    words = ("<|startoftext|>", "<|endoftext|>", "rubber</w>", "band</w>")
    vocabulary = {word: number for number, word in enumerate(words)}
    CLIPTokenizer(vocab=vocabulary, merges=[]).save_pretrained(folder)
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
        found = mask.mask(frame)
        assert found.shape == frame.depth.shape and found.dtype == bool
        assert not (found & ~frame.near).any()
        np.testing.assert_array_equal(found, again.mask(frame))
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
        found = mask.mask(frame)
        band = truths[number].part[view.window] == looks.BAND
        band &= np.abs(frame.depth - truths[number].depth[view.window]) < 0.005
        hits += (found & band).sum() / band.sum() / len(view)
        wrong += (found & ~band & (frame.depth > 0)).sum() / max(1, found.sum()) / len(view)
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

    kept = load_file(folder / "model.safetensors")
    kept.pop(sorted(kept)[0])
    save_file(kept, folder / "model.safetensors", metadata={"format": "pt"})


def test_a_device_that_is_not_there(weights, view) -> None:
    with pytest.raises(UserError, match="cuda:77: there is no such GPU"):
        masker("sam3", view, settings(weights, device="cuda:77"))


def test_without_transformers(weights, view, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(UserError, match=r"transformers is not installed.*\[sam3\]"):
        masker("sam3", view, settings(weights))
