"""The whole report of a synthetic run: complete, reproducible, and refused where inputs lack."""

import json
import os
import re
import shutil
import subprocess
import sys

import pandas as pd
import pytest

from pipeline.report.report import HTML, write
from sling2sim2real.base.files import NotMade
from tests.project import with_
from tests.report.conftest import BAND, PAIR
from tests.report.toy_run import run_of, write_run

pytestmark = pytest.mark.usefixtures("no_simulation")
THETA_FILE = f"data/theta/{PAIR}.json"


def written(root, params) -> str:
    """The texts of both pages, one after the other."""
    write(params, root)
    return "\n".join((root / "reports" / f"{name}.md").read_text() for name in HTML)


ELSEWHERE = """\
from pathlib import Path
from pipeline.params import load
from pipeline.report import report
from pipeline.report.figures import search, simulation
from tests.report.toy_simulation import toy_landscape, toy_replay
from tests.report.toy_run import run_of
simulation.replayed, search.landscape = toy_replay, toy_landscape
root = Path({root!r})
report.write(run_of(load(root / "params.yaml")), root)
"""


def committed(root) -> dict:
    """Bytes of what Git and DVC know of a report."""
    files = (root / "reports").rglob("*")
    return {f: f.read_bytes() for f in files if f.is_file()}


@pytest.mark.slow
def test_the_report_is_complete_and_equal_in_another_process(root, params) -> None:
    write_run(root)
    text, first = written(root, run_of(params)), committed(root)
    pictures = re.findall(r"\]\((figures/[^)]+)\)", text)
    assert len(pictures) == len(set(pictures)) <= 15
    assert {root / "reports" / name for name in pictures} == {
        file for file in first if file.suffix == ".png"
    }
    names = "index.html", "appendix.html"
    page = "\n".join((root / "reports" / name).read_text("utf-8") for name in names)
    assert set(re.findall(r'href="([a-z]+\.html)"', page)) == {*names}
    assert page.count('src="data:image/png;base64,') == len(pictures)
    for title in re.findall("^## (.*)$", text, re.MULTILINE):
        assert f">{title}</h2>" in page
    shutil.rmtree(root / "reports")
    other = os.environ | {"PYTHONHASHSEED": "7", "TZ": "Asia/Seoul", "OMP_NUM_THREADS": "1"}
    code = ELSEWHERE.format(root=str(root))
    subprocess.run([sys.executable, "-c", code], env=other, check=True)
    assert committed(root) == first


def test_a_band_that_nobody_launched_is_told_without_emptiness(root, params, text_alone) -> None:
    file = root / "data" / "trials" / f"{PAIR}.parquet"
    nothing = {"kind": "predicted", "landing_y": None, "failure": None}
    pd.read_parquet(file).assign(**nothing).to_parquet(file)
    text = written(root, params)
    assert "Nothing was launched in this run" in text and "a robot; no launch yet\n" in text
    assert re.findall("^### (Table .)$", text, re.MULTILINE) == ["Table 2"]
    for absent in ("landings.png", "*virtual*", "actuation", "in the 90 %"):
        assert absent not in text
    assert json.loads((root / "reports" / "summary.json").read_text()) == {f"{BAND}_kPa": 300.0}


def test_a_theta_by_hand_needs_no_confidence(root, params, text_alone) -> None:
    theta = json.loads((root / THETA_FILE).read_text())
    (root / THETA_FILE).write_text(json.dumps({"band": BAND, "theta": theta["theta"]}))
    text = written(root, params)
    assert re.search(r"\| 300 +\| 0.45 +\|", text)
    assert "† The interval holds the draw's error alone" in text


def test_names_the_input_that_is_missing(root, params) -> None:
    for name in (
        f"episodes/{BAND}/plain/1/signals.parquet",
        *(f"{step}/{PAIR}.parquet" for step in ("evaluations", "trials")),
        *(f"{step}/{PAIR}.json" for step in ("clusters", "theta")),
        f"policies/{PAIR}/card.json",
    ):
        away = (root / "data" / name).rename(root / "away")
        with pytest.raises(NotMade, match=f"{re.escape(name)}: missing"):
            write(params, root)
        assert not (root / "reports").exists()
        away.rename(root / "data" / name)
    with pytest.raises(NotMade, match=f"floor/{BAND}.json: missing"):
        write(with_(params, "run", floors=(BAND,)), root)
