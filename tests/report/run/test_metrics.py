"""summary.json: the run in a dozen numbers, readable in a terminal."""

import json
import math
from pathlib import Path

import pytest

from pipeline.base.files import write_json
from pipeline.report.run.metrics import summary
from tests.report.run.tables.toy_results import floor, launches, result, results
from validation.projects import ProjectCopy

MAIN, THEIRS = "least_squares", "sling2sim2real"
COLUMNS = 120


def ranged(errors, **more):
    """Launches that land where they were predicted, in intervals of 10 % of the distance."""
    trials = launches(errors, **more)
    low, high = 0.95 * trials.landing_y, 1.05 * trials.landing_y
    return trials.assign(predicted_y=trials.landing_y, predicted_low=low, predicted_high=high)


def test_numbers_by_hand() -> None:
    ran = results(
        result("band1", MAIN, ranged([[0.03, -0.01]] * 3)),
        result("band1", THEIRS, launches([[0.1] * 2] * 3)),
        result("band2", MAIN, ranged([[0.05] * 2] * 3, failed=2)),
        result("band2", THEIRS, launches([[0.2] * 2] * 3)),
        floors={name: floor((0.01,) * 3, (0.01,) * 3) for name in ("band1", "band2")},
    )
    assert summary(ran, MAIN, THEIRS) == {
        "band1_cm": 2.0, "band2_cm": 5.0, "floors": 3.5, "paper_cm": 15.0, "failed": 2,
        "bias_%": pytest.approx(0, abs=1e-9), "in_90_%": 100.0, "width_%": 10.0,
    }  # fmt: skip


def test_an_oracle_that_never_lands_is_no_floor() -> None:
    lost = {"band1": floor((0.01,) * 3, (0.01,) * 3) | {"mean_error_m": None}}
    ran = results(result("band1", MAIN, launches([[0.03]] * 3)), floors=lost)
    assert "floors" not in summary(ran, MAIN, None)


def test_a_band_that_was_never_launched_shows_its_modulus() -> None:
    nothing = launches([[math.nan]] * 3, "predicted")
    assert summary(results(result("mine", MAIN, nothing)), MAIN, None) == {"mine_kPa": 300.0}


def test_three_bands_fit_a_terminal_and_pictures_need_no_network(tmp_path) -> None:
    """As DVC itself shows them; a plot of data would have its page load Vega."""
    names = "band1_cm", "band2_cm", "band3_cm", "floors", "paper_cm", "failed"
    some = dict.fromkeys((*names, "bias_%", "in_90_%", "width_%"), -1.25)
    write_json(tmp_path / "reports" / "summary.json", some)
    (tmp_path / "reports" / "figures").mkdir()
    (tmp_path / "reports" / "figures" / "one.png").write_bytes(b"\x89PNG of bytes")
    plots = "plots:\n  - reports/figures\n"
    assert plots in Path("dvc.yaml").read_text()
    (tmp_path / "dvc.yaml").write_text(f"metrics:\n  - reports/summary.json\n{plots}")
    project = ProjectCopy(tmp_path, COLUMNS=str(COLUMNS))
    project("dvc", "init", "--no-scm", "--quiet")
    lines = project("dvc", "metrics", "show").splitlines()
    assert len(lines) == 2 and max(map(len, lines)) <= COLUMNS
    project("dvc", "plots", "show", "--quiet")
    page = (tmp_path / "dvc_plots" / "index.html").read_text()
    assert "one.png" in page and "http" not in page and "<script" not in page
    assert json.loads((tmp_path / "reports" / "summary.json").read_text()) == some
