"""The chapter of tables: complete, linked to its files, and silent about what did not run."""

import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from pipeline.drawing.styles import styles
from pipeline.params import load
from pipeline.report.tables.paper_tables import paper_tables
from tests.report.conftest import confidence
from tests.report.tables.toy_results import floor, launches, result, results

PARAMS = load()
NOISE = np.random.default_rng(0).normal(0, 0.01, (3, 5))
NAMED = styles(["least_squares", "package_si", "de"])


@pytest.fixture
def written(tmp_path):
    def run(*some, floors=None) -> str:
        ran = results(*some, floors=floors)
        return paper_tables(
            SimpleNamespace(params=PARAMS, results=ran, styles=NAMED, folder=tmp_path)
        )

    return run


def test_every_table_is_there_in_each_form(written, tmp_path) -> None:
    ours = launches(0.05 + NOISE)
    ran = (
        result("band1", "least_squares", ours),
        result("band1", "package_si", launches(0.2 + NOISE)),
        result("band1", "de", launches(0.1 + NOISE)),
    )
    floors = {"band1": floor((0.01,) * 3, (0.01,) * 3)}
    text = written(*ran, floors=floors)
    assert re.findall("^### (.*)$", text, re.MULTILINE) == [
        *(f"Table {number}" for number in (1, 2, 3, 4)),
        "Which differences are more than noise",
    ]
    links = re.findall(r"\]\((tables/.*?)\)", text)
    files = {file.relative_to(tmp_path).as_posix() for file in (tmp_path / "tables").iterdir()}
    assert {*links, "tables/differences.csv"} == files and len(links) == 8
    assert all(len(pd.read_csv(tmp_path / name)) for name in files if name.endswith("csv"))
    assert "*Actuation floor*" in text and "more error: Package SI · DE_L" in text
    first = {name: (tmp_path / name).read_bytes() for name in files}
    assert written(*ran, floors=floors) == text
    assert {name: (tmp_path / name).read_bytes() for name in files} == first


def test_nothing_is_said_of_what_did_not_run(written, tmp_path) -> None:
    nothing = launches(np.full((3, 1), np.nan), "predicted")
    text = written(result("band3", "package_si", nothing, confidence={}))
    assert "Actuation floor" not in text and "more than noise" not in text
    assert not (tmp_path / "tables" / "differences.csv").exists()
    assert "No θ of this run comes with a confidence" in text
    assert "|  | Package SI | no launch yet | – |" in text


def test_warnings_stand_below_table_2(written) -> None:
    about = confidence() | {"steps": 14, "settled": False}
    about["recordings"][0]["pictures"] = []
    trials = launches(0.05 + NOISE)
    theta = {"theta": result("", "", trials).theta["theta"] | {"damping_scale": 1.0}}
    text = written(result("band1", "de", trials, confidence=about, theta=theta))
    section = text.split("### Table 2")[1].split("### Table 3")[0]
    assert "fit of band1, DE_L had **not settled** after 14 steps" in section
    assert "No picture shows the recoil of band1: DE_L has its damping" in section
    assert "⚠ the search ended at a side of its box" in section
    other = written(result("band1", "de", trials))
    assert "not settled" not in other and "⚠" not in other
