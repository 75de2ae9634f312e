"""The card as it is written: whole, small, alone, the same twice; and played in a browser."""

import base64
import json
import re
import shutil

import numpy as np
import pytest
from PIL import Image

from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from pipeline.params import load
from pipeline.report.card.page import packed, thinned
from pipeline.report.card.text import GLOSSARY
from pipeline.report.card.write import write
from tests.report.card.conftest import BAND, METHOD, THETA
from tests.visit import DESKTOP, PHONE, overflow, visited

FILES = {
    "README.md", "card.json", "index.html", "animation.webp", "camera.webp", "force.png",
    "values.png", "landings.png",
}  # fmt: skip
LIMITS = {"index.html": 1.5e6, "animation.webp": 2e6}  # bytes
NEVER = "http://example.invalid/picture.png"


@pytest.fixture(scope="module")
def folder(project, tmp_path_factory):
    """The card, written once."""
    root = shutil.copytree(project, tmp_path_factory.mktemp("written") / "project")
    write(load(root / "params.yaml"), BAND, METHOD, root)
    return Layout(root).card(BAND)


def test_it_is_whole_and_small(folder) -> None:
    assert {file.name for file in folder.iterdir()} == FILES
    for name, most in LIMITS.items():
        assert (folder / name).stat().st_size < most
    text = (folder / "README.md").read_text()
    assert len(text.split()) <= 600
    shown = re.findall(r"\]\(([^)]+)\)", text)
    assert set(shown) - {GLOSSARY} == FILES - {"README.md", "card.json", "index.html"}
    titles = re.findall("^#+ (.*)$", text, re.MULTILINE)
    assert titles[0].startswith(f"{BAND}: ") and "Where to draw" in titles


def test_a_program_reads_the_same(folder) -> None:
    card = json.loads((folder / "card.json").read_text())
    assert card["band"] == BAND and card["method"] == METHOD
    assert card["verdict"] in ("can be trusted", "with care", "no") and card["reasons"]
    assert [draw["target_m"] for draw in card["draws"]] == [1.725, 1.925, 2.125]
    young = next(row for row in card["values"] if row["name"] == "youngs_modulus")
    assert young["value"] == pytest.approx(THETA["youngs_modulus"] / 1000)
    assert (young["low"], young["high"]) == pytest.approx((285, 315)) and young["unit"] == "kPa"
    fixed = {row["name"] for row in card["values"] if row["fixed"]}
    assert fixed == {"poissons_ratio", "dynamic_friction", "damping_scale"}
    assert (card["recordings"], card["pulls"], card["launches"]) == (1, 1, 0)
    assert all(sentence.endswith(".") for sentence in card["reasons"] + card["next"])


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


def test_the_page_asks_for_nothing(folder) -> None:
    page = (folder / "index.html").read_text()
    outside = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    for address in re.findall(r"""(?:src|href)=["']([^"']*)["']""", outside):
        assert address.startswith(("data:", "#"))
    inside = page.replace("http-equiv", "")
    assert not any(word in inside for word in ("http", "@import", "<script src"))


def test_equal_inputs_give_equal_bytes(folder, copied) -> None:
    write(load(copied / "params.yaml"), BAND, METHOD, copied)
    for file in folder.iterdir():
        assert file.read_bytes() == (Layout(copied).card(BAND) / file.name).read_bytes(), file.name


def test_without_a_density_it_tells_less(copied) -> None:
    layout = Layout(copied)
    path = layout.theta(BAND, METHOD)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"confidence": None}))
    layout.confidence(BAND, METHOD).write_text('{"samples": []}')
    card = write(load(copied / "params.yaml"), BAND, METHOD, copied)
    assert card["verdict"] != "can be trusted"
    assert any("does not tell how sure" in reason for reason in card["reasons"])
    assert all(row["low"] is None for row in card["values"])


def test_a_missing_input_leaves_nothing_half_written(copied) -> None:
    layout = Layout(copied)
    layout.trials(BAND, METHOD).unlink()
    with pytest.raises(UserError, match=r"data/trials/toy/least_squares\.parquet"):
        write(load(copied / "params.yaml"), BAND, METHOD, copied)
    assert not layout.card(BAND).exists()


def test_places_are_whole_millimetres_and_clouds_thinner() -> None:
    points = np.random.default_rng(1).uniform(-2, 2, (500, 3))
    whole = np.frombuffer(base64.b64decode(packed(points)), "<i2").reshape(-1, 3)
    np.testing.assert_allclose(whole / 1000, points, atol=5.1e-4)
    thin = thinned(points, 90)
    assert thin.shape == (90, 3)
    assert {tuple(point) for point in thin} <= {tuple(point) for point in points}
    assert thinned(points[:0], 90).shape == (0, 3)


PIXELS = "document.getElementById('view').toDataURL()"


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
def test_the_replay_runs_alone(folder, width: int) -> None:
    with visited(folder / "index.html", width) as seen:
        page = seen.page
        assert overflow(seen) <= 0

        def clock() -> str:
            return page.inner_text("#clock")

        def slid(value: float) -> str:
            page.evaluate(
                "value => { const s = document.getElementById('moment'); s.value = value;"
                " s.dispatchEvent(new Event('input')); }",
                value,
            )
            return page.evaluate(PIXELS)

        assert clock() == "t = −30.0 ms"
        first, later = page.evaluate(PIXELS), slid(0.05)
        assert clock() == "t = +50.0 ms" and first != later
        page.click("#next")
        assert clock() == "t = +70.3 ms"  # the truth's pictures are 1/15 s apart
        page.click("#next")
        assert page.evaluate(PIXELS) != later
        slid(0.05)
        page.focus("#view")
        page.keyboard.press("ArrowLeft")
        turned = page.evaluate(PIXELS)
        assert turned != later
        box = page.locator("#view").bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 160, box["y"] + 120)
        page.mouse.up()
        assert page.evaluate(PIXELS) != turned
        page.select_option("#speed", "1")
        slid(-0.03)
        page.click("#play")
        page.wait_for_timeout(600)
        assert clock() == "t = +150.0 ms" and "play" in page.inner_text("#play")
        page.select_option("#part", "all")
        assert clock().endswith(" s") and clock().startswith("t = −")
        assert seen.errors == [] and seen.elsewhere == set()
        page.evaluate(f"new Image().src = '{NEVER}'")
        page.wait_for_timeout(300)
        assert seen.errors or seen.elsewhere, "a request is not noticed at all"
