"""The whole report of a synthetic run: complete, reproducible, and refused where inputs lack."""

from __future__ import annotations

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest

from pipeline.errors import UserError
from pipeline.policy.trials import SCHEMA
from pipeline.report import write as writing
from pipeline.report.replay import Replay
from tests.report.conftest import BAND, METHOD


@pytest.fixture(autouse=True)
def no_simulation(monkeypatch) -> None:
    def replay(params, band, episode, theta) -> Replay:
        return Replay(0.9 * episode.force, np.stack([cloud + 0.01 for cloud in episode.clouds]))

    monkeypatch.setattr(writing, "replay", replay)


def test_the_report_is_complete_and_equal_twice(root, params) -> None:
    writing.write(params, root)
    first = {f: f.read_bytes() for f in (root / "reports").rglob("*") if f.is_file()}
    text = (root / "reports" / "README.md").read_text()
    pictures = re.findall(r"\]\((figures/[^)]+)\)", text)
    assert len(pictures) == len(set(pictures)) == 6
    assert {root / "reports" / name for name in pictures} == {
        file for file in first if file.suffix == ".png"
    }
    assert "3.00 ± 0.71" in text  # |miss| 2 and 3 cm, then 4 cm; one target has a deviation
    assert "1 of 4" in text and "paper" in text
    shutil.rmtree(root / "reports")
    writing.write(params, root)
    assert {f: f.read_bytes() for f in (root / "reports").rglob("*") if f.is_file()} == first


def test_a_failed_prediction_is_named(root, params) -> None:
    file = root / "data" / "trials" / BAND / f"{METHOD}.parquet"
    good = pd.read_parquet(file)
    writing.write(params, root)
    text = (root / "reports" / "README.md").read_text()
    assert "could not be predicted" not in text and "stretch, is met" in text
    bad = good.assign(
        predicted_y=[1.725, None, 1.925, 2.125],
        predicted_failure=[None, "the simulation did not converge", None, None],
        hold_force=[9.0, None, 9.0, 9.0],
    )
    bad.to_parquet(file, schema=SCHEMA)
    writing.write(params, root)
    text = (root / "reports" / "README.md").read_text()
    assert "1 of 4 launches could not be predicted" in text
    assert "**not** met: 1 launches there are not predicted" in text
    assert "| 1 of 4 |" in text and "hold force, predicted [N]" in text
    assert "| 1.40 | – | the simulation did not converge |" in text
    far = good.assign(predicted_y=2 * good.predicted_y)
    far.to_parquet(file, schema=SCHEMA)
    writing.write(params, root)
    assert "stretch, is **not** met" in (root / "reports" / "README.md").read_text()


def test_metrics_are_the_numbers_of_the_tables(root, params) -> None:
    writing.write(params, root)
    metrics = json.loads((root / "reports" / "metrics.json").read_text())[BAND][METHOD]
    assert metrics["loss"] == 1.25
    assert metrics["measured_landing_error_cm"] == pytest.approx(3.0, abs=1e-3)
    assert metrics["measured_failed"] == 1
    inside = (abs(1.725 / 1.745 - 1) + abs(1.725 / 1.695 - 1)) / 2
    assert metrics["prediction_error_inside_percent"] == pytest.approx(100 * inside, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "stage"),
    [
        (f"data/episodes/{BAND}/signals.parquet", f"episode@{BAND}"),
        (f"data/history/{BAND}/{METHOD}.parquet", f"history@{BAND}-{METHOD}"),
        (f"data/refined/{BAND}/{METHOD}.parquet", f"refined@{BAND}-{METHOD}"),
        (f"data/theta/{BAND}/{METHOD}.json", f"theta@{BAND}-{METHOD}"),
        (f"data/policies/{BAND}/{METHOD}/card.json", f"policy@{BAND}-{METHOD}"),
        (f"data/policies/{BAND}/{METHOD}/map.parquet", f"policy@{BAND}-{METHOD}"),
        (f"data/trials/{BAND}/{METHOD}.parquet", f"trials@{BAND}-{METHOD}"),
    ],
)
def test_names_the_input_that_is_missing(root, params, name: str, stage: str) -> None:
    (root / name).unlink()
    with pytest.raises(UserError, match=f"{re.escape(name)}: missing.*dvc repro {stage}`"):
        writing.write(params, root)
    assert not (root / "reports").exists()
