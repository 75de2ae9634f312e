"""SAM 3 with few, narrow layers and random weights: a mask for each picture, of its size."""

import cv2
import numpy as np
import pytest

from tests.examples.tiny_sam3 import save_tiny_sam3
from tests.project import ROOT, python

pytest.importorskip("transformers", reason="sam3 is an extra")
SCRIPT = ROOT / "examples/sam3_masks.py"


@pytest.mark.slow
def test_each_picture_gets_its_mask(tmp_path) -> None:
    """Then `cloud.mask: folder` takes them: tests/recording/masks/test_folder.py."""
    save_tiny_sam3(tmp_path / "weights")
    (tmp_path / "to_mask").mkdir()
    pictures = np.random.default_rng(1).integers(0, 256, (3, 48, 64, 3), np.uint8)
    for number, picture in enumerate(pictures):
        cv2.imwrite(str(tmp_path / f"to_mask/170000000000{number}.png"), picture)
    options = ("--weights", "weights", "--device", "cpu")
    done = python(SCRIPT, "to_mask", "my.masks", *options, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    masks = sorted((tmp_path / "my.masks").iterdir())
    assert [mask.name for mask in masks] == [f"170000000000{number}.png" for number in range(3)]
    for mask in masks:
        pixels = cv2.imread(str(mask), cv2.IMREAD_UNCHANGED)
        assert pixels.shape == (48, 64) and set(np.unique(pixels)) <= {0, 255}
    done = python(SCRIPT, "to_mask", "my.masks", "--weights", "none", folder=tmp_path)
    assert done.returncode == 1 and done.stderr.startswith("error: none: ")
