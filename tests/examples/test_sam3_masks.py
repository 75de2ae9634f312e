"""The script for SAM 3 with a stand-in for the network: pictures go in and masks come out."""

import runpy
import sys
from types import ModuleType, SimpleNamespace

import cv2
import numpy as np
import pytest
import torch

from tests.project import ROOT

SCRIPT = str(ROOT / "examples/sam3_masks.py")


class Network:
    """Finds whatever is red, as one object; another one is everywhere and hidden."""

    config, dtype = SimpleNamespace(image_size=112), torch.float32

    @classmethod
    def from_pretrained(cls, folder, **more):
        if not folder.is_dir():
            raise OSError(f"{folder} has no weights\nat all")
        return cls()

    def to(self, device):
        return self

    def eval(self):
        return self

    def propagate_in_video_iterator(self, session):
        for picture in session.video:
            assert picture.shape == (3, 112, 112) and -1 <= picture.min() and picture.max() <= 1
            masks = {1: picture[:1], 2: torch.ones(1, 112, 112)}
            yield SimpleNamespace(suppressed_obj_ids={2}, obj_id_to_mask=masks)


def session(video, **more):
    inputs = {"prompt_input_ids": {}, "prompt_attention_masks": {}}
    return SimpleNamespace(
        video=video, add_prompt=lambda prompt: 0, hotstart_removed_obj_ids=set(), **inputs
    )


def tokenizer(prompt, **more):
    tokens = SimpleNamespace(input_ids=prompt, attention_mask=None)
    return SimpleNamespace(to=lambda device: tokens)


def test_each_picture_gets_its_mask(tmp_path, monkeypatch) -> None:
    """Of its size; `cloud.mask: folder` takes them then."""
    fakes = {
        "transformers": {
            "AutoTokenizer": SimpleNamespace(from_pretrained=lambda *_, **__: tokenizer),
            "Sam3VideoModel": Network,
        },
        "transformers.models": {},
        "transformers.models.sam3_video": {},
        "transformers.models.sam3_video.modeling_sam3_video": {
            "Sam3VideoInferenceSession": session
        },
    }
    for name, content in fakes.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "to_mask").mkdir()
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:, 32:, 2] = 255  # its right half is red
    cv2.imwrite("to_mask/1700000000001.png", picture)
    command = [SCRIPT, "to_mask", "my.masks", "--device", "cpu", "--weights"]
    monkeypatch.setattr(sys, "argv", [*command, str(tmp_path)])
    runpy.run_path(SCRIPT, run_name="__main__")
    mask = cv2.imread("my.masks/1700000000001.png", cv2.IMREAD_UNCHANGED)
    assert mask.shape == (48, 64)
    assert not mask[:, :30].any() and (mask[:, 34:] == 255).all()
    monkeypatch.setattr(sys, "argv", [*command, "none"])
    with pytest.raises(SystemExit, match="^error: none: none has no weights$"):
        runpy.run_path(SCRIPT, run_name="__main__")
