"""The stage of the trials on a recorded band: whose launches stand in its table, and how often."""

import sys
from pathlib import Path

import pandas as pd
import pytest

from sling2sim2real.base.files import write_text
from tests.report.conftest import BAND, METHOD
from tests.report.conftest import root as root  # noqa: PLC0414
from tests.report.conftest import template as template  # noqa: PLC0414

HEAD = "draw_y,draw_z,landing,use,target,method"


@pytest.fixture
def tried(root: Path, monkeypatch):
    """Run the stage in a finished project; its rows."""
    monkeypatch.chdir(root)

    def run(csv: str = "draw_y,draw_z,error,landing,use\n") -> pd.DataFrame:
        write_text(Path("data/launches", f"{BAND}.csv"), csv)
        from stages import trials

        monkeypatch.setattr(sys, "argv", ["", f"{BAND}-{METHOD}"])
        trials.main()
        return pd.read_parquet(Path("data/trials", f"{BAND}-{METHOD}.parquet"))

    return run


def test_without_landings_the_policys_draws_are_predicted(tried) -> None:
    rows = tried()
    assert rows.kind.tolist() == ["predicted"] * 3
    assert rows.target.tolist() == [1.725, 1.925, 2.125]
    assert rows.landing_y.isna().all() and rows.predicted_y.notna().all()
    assert rows.predicted_speed.gt(0).all() and rows.flight_y.isna().all()


def test_measured_launches_take_their_place(tried) -> None:
    text = (
        f"{HEAD}\n-0.30,-0.17,2.2,check,1.925,{METHOD}\n-0.30,-0.17,,check,1.925,{METHOD}\n"
        "-0.31,-0.17,2.3,check,1.925,\n-0.29,-0.15,1.9,check,1.725,package_si\n"
        "-0.29,-0.15,1.9,fit,,\n"
    )
    rows = tried(text)
    assert rows.kind.tolist() == ["measured"] * 3
    assert rows.target.fillna(0).tolist() == [1.925, 1.925, 0]
    assert rows.failure.fillna("").tolist() == ["", "did not land", ""]
    assert rows.predicted_y[0] == rows.predicted_y[1] != rows.predicted_y[2]
    assert rows.hold_force.gt(0).all()
