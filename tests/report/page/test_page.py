"""The page as text: whole, alone, and the same twice; its numbers are those of the replay."""

import base64
import json
import re

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.report.page import replays as packing
from pipeline.report.page import write_page
from pipeline.report.report import Report
from pipeline.report.styles import styles
from tests.report.conftest import BAND, METHOD
from tests.report.toy_replay import toy_replay

MARKDOWN = """\
# What came out

Before.

## In short

| a | b |
| --- | --- |
| 1.5 | x < y |

## Band & more

![picture](figures/one.png)
"""
PICTURE = b"\x89PNG of bytes"


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<i2").reshape(-1, 3)


@pytest.fixture
def replays(results):
    return {BAND: {METHOD: toy_replay(None, BAND, METHOD, results.episodes[BAND], {})}}


@pytest.fixture
def report(tmp_path, params, results, replays) -> Report:
    return Report(params, results, replays, styles([METHOD]), tmp_path / "shown")


@pytest.fixture
def page(report: Report) -> str:
    folder = report.folder
    (folder / "figures").mkdir(parents=True)
    (folder / "figures" / "one.png").write_bytes(PICTURE)
    write_page(report, MARKDOWN)
    return (folder / "index.html").read_text("utf-8")


def test_the_report_is_in_the_page_with_its_pictures(page: str) -> None:
    assert "<td>1.5</td>" in page and "<td>x &lt; y</td>" in page
    encoded = base64.b64encode(PICTURE).decode()
    assert f'src="data:image/png;base64,{encoded}"' in page
    for name, title in (
        ("chapter-1-in-short", "In short"),
        ("chapter-2-band-more", "Band &amp; more"),
    ):
        assert f'<a href="#{name}">{title}</a>' in page and f'<h2 id="{name}">{title}</h2>' in page
    order = [
        page.index(text) for text in ("Before.", 'id="chapter-1', 'id="replay"', 'id="chapter-2')
    ]
    assert order == sorted(order)


def test_the_page_asks_for_nothing_but_run_js(page: str) -> None:
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page)[1]
    assert policy.startswith("default-src 'none'") and "http" not in policy
    outside = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    for attribute in re.findall(r"""(?:src|href)=["']([^"']*)["']""", outside):
        assert attribute.startswith(("data:", "#"))
    asked = re.findall("<script src.*?>", page)
    assert asked == ['<script src="run.js">'] and "@import" not in outside


def test_the_replays_numbers_are_whole_millimetres(page: str, results, replays) -> None:
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])
    (band,) = data["bands"]
    episode, (method,) = results.episodes[BAND], band["methods"]
    assert band["counts"] == [len(cloud) for cloud in episode.clouds]
    clouds = np.concatenate(episode.clouds)
    np.testing.assert_allclose(unpacked(band["cloud"]) / 1000, clouds, atol=5.1e-4)
    line = replays[BAND][METHOD].center_line.reshape(-1, 3)
    np.testing.assert_allclose(unpacked(method["line"]) / 1000, line, atol=5.1e-4)
    np.testing.assert_allclose(method["distance"], 10.0)  # a centimetre
    np.testing.assert_allclose(band["times"], episode.cloud_time)
    assert all(np.array(band["low"]) < clouds.min(0)) and all(
        np.array(band["high"]) > clouds.max(0)
    )


def test_a_thinned_cloud_keeps_points_of_the_cloud() -> None:
    cloud = np.arange(3000, dtype=np.float32).reshape(1000, 3)
    thin = packing.thinned(cloud)
    assert thin.shape == (packing.POINTS, 3)
    assert {tuple(point) for point in thin} <= {tuple(point) for point in cloud}
    assert len({tuple(point) for point in thin}) == packing.POINTS
    assert packing.thinned(cloud[:0]).shape == (0, 3)


def test_a_missing_picture_is_named(report: Report) -> None:
    with pytest.raises(UserError, match="figures/one.png: cannot be read.*dvc repro"):
        write_page(report, MARKDOWN)
