"""The chapter of tables: complete, linked to its files, and silent about what did not run."""

import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from pipeline.params import load
from pipeline.report.drawing.styles import styles
from pipeline.report.run.chapters.paper_tables import paper_tables
from tests.project import DEFAULTS
from tests.report.run.tables.toy_results import floor, launches, result, results

PARAMS = load(DEFAULTS)
NOISE = np.random.default_rng(0).normal(0, 0.01, (3, 5))
NAMED = styles(["least_squares", "package_si", "de", "no_work"])


@pytest.fixture
def written(tmp_path):
    def run(*some, floors=None) -> str:
        ran = results(*some, floors=floors)
        return paper_tables(
            SimpleNamespace(params=PARAMS, results=ran, styles=NAMED, folder=tmp_path)
        )

    return run


def test_every_table_is_there_and_on_file(written, tmp_path) -> None:
    ours = launches(0.05 + NOISE)
    ran = (
        result("band1", "least_squares", ours),
        result("band1", "package_si", launches(0.2 + NOISE)),
        result("band1", "de", launches(0.1 + NOISE)),
        result("band1", "no_work", launches(0.1 + NOISE)),
    )
    floors = {"band1": floor((0.01,) * 3, (0.01,) * 3)}
    text = written(*ran, floors=floors)
    tables = re.findall("^### (.*)$", text, re.MULTILINE)
    assert tables == [f"Table {number}" for number in (1, 2, 3, 4)]
    links = re.findall(r"\]\((tables/.*?)\)", text)
    files = {file.relative_to(tmp_path).as_posix() for file in (tmp_path / "tables").iterdir()}
    assert set(links) == files and len(links) == 4
    assert all(len(pd.read_csv(tmp_path / name)) for name in files if name.endswith("csv"))
    assert "*Actuation floor*" in text
    first = {name: (tmp_path / name).read_bytes() for name in files}
    assert written(*ran, floors=floors) == text
    assert {name: (tmp_path / name).read_bytes() for name in files} == first


def test_nothing_is_said_of_what_did_not_run(written, tmp_path) -> None:
    nothing = launches(np.full((3, 1), np.nan), "predicted")
    text = written(result("band3", "package_si", nothing, confidence={}))
    assert re.findall("^### (.*)$", text, re.MULTILINE) == ["Table 2"]
    assert "Actuation floor" not in text and "90 %" not in text and "not run" not in text
    assert {file.name for file in (tmp_path / "tables").iterdir()} == {"table2.csv"}


def test_an_optimum_at_a_side_of_its_box_is_marked(written) -> None:
    trials = launches(0.05 + NOISE)
    theta = {"theta": result("", "", trials).theta["theta"] | {"damping_scale": 1.0}}
    edge = "⚠ the search ended at a side of its box"
    assert edge in written(result("band1", "de", trials, theta=theta))
    assert edge not in written(result("band1", "de", trials))
