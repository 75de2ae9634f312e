"""The card as it is written: whole, small, alone, the same twice."""

import re
import shutil

import numpy as np
import pytest
from PIL import Image

from pipeline.band_folder import write
from pipeline.layout import Layout
from sling2sim2real import Identification, aim
from sling2sim2real.base.errors import UserError
from sling2sim2real.card.text import GLOSSARY
from tests.card.conftest import BAND, PAIR

FILES = {
    "README.md", "card.json", "index.html", "animation.webp", "camera.webp", "force.png",
    "landings.png",
}  # fmt: skip
LIMITS = {"index.html": 3e6, "animation.webp": 2e6}  # bytes


@pytest.fixture(scope="module")
def folder(project, tmp_path_factory):
    """The card, written once."""
    root = shutil.copytree(project, tmp_path_factory.mktemp("written") / "project")
    write(PAIR, root)
    return Layout(root).card(PAIR) / "card"


def test_its_folder_is_a_bands_folder(folder) -> None:
    """What a run has found is aimed by the policy that it trained."""
    names = {path.name for path in folder.parent.iterdir()}
    assert names == {"band.yaml", "theta.json", "policy.onnx", "policy.json", "card"}
    found = Identification.load(folder.parent)
    assert not found.stale and found.band.name == BAND and found.fork
    drawn = found.policy.draws(np.array([1.925]))[0]
    np.testing.assert_array_equal(aim(found, 1.925, anyway=True).draw, drawn)


def test_it_is_whole_and_small(folder) -> None:
    assert {file.name for file in folder.iterdir()} == FILES
    for name, most in LIMITS.items():
        assert (folder / name).stat().st_size < most
    text = (folder / "README.md").read_text()
    assert len(text.split()) <= 650
    shown = re.findall(r"\]\(([^)]+)\)", text)
    assert set(shown) - {GLOSSARY} == FILES - {"README.md", "card.json", "index.html"}
    titles = re.findall("^#+ (.*)$", text, re.MULTILINE)
    assert titles[0].startswith(f"{BAND}: ") and "Where to draw" in titles


def test_the_animation_plays(folder) -> None:
    with Image.open(folder / "animation.webp") as image:
        assert image.n_frames > 20
        frames = []
        for number in (0, image.n_frames // 2, image.n_frames - 1):
            image.seek(number)
            frames.append(np.asarray(image.convert("RGB"), int))
    assert all(np.abs(a - b).max() > 100 for a, b in zip(frames, frames[1:], strict=False))
    magenta = np.abs(frames[0][60:, 480:] - [0xE0, 0, 0x7A]).max(axis=2) < 60
    assert magenta.sum() > 200  # the simulated band


def test_equal_inputs_give_equal_bytes(folder, copied) -> None:
    write(PAIR, copied)
    for file in folder.iterdir():
        assert file.read_bytes() == (Layout(copied).card(PAIR) / "card" / file.name).read_bytes(), (
            file.name
        )


def test_a_missing_input_leaves_nothing_half_written(copied) -> None:
    layout = Layout(copied)
    layout.trials(PAIR).unlink()
    with pytest.raises(UserError, match=r"data/trials/toy-posterior\.parquet"):
        write(PAIR, copied)
    assert not layout.card(PAIR).exists()
