"""The stage of the trials on a recorded band: whose launches stand in its table, and how often."""

import sys
from pathlib import Path

import pandas as pd
import pytest
from ruamel.yaml import YAML

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from tests.report.conftest import BAND, METHOD
from tests.report.conftest import root as root  # noqa: PLC0414
from tests.report.conftest import template as template  # noqa: PLC0414

HEAD = "draw_y_m,draw_z_m,landing_y_m,target_m,method"


@pytest.fixture
def tried(root: Path, monkeypatch):
    """Run the stage in a finished project; its rows."""
    monkeypatch.chdir(root)

    def run(csv: str | None = None) -> pd.DataFrame:
        if csv is not None:
            file = Path("data/trials/measured", f"{BAND}.csv")
            file.parent.mkdir(exist_ok=True)
            file.write_text(csv)
        from stages import evidence, launches, trials

        monkeypatch.setattr(sys, "argv", ["", BAND])
        evidence.main()
        monkeypatch.setattr(sys, "argv", ["", BAND, METHOD])
        if load().bands[BAND].source == "rig":
            launches.main()
        trials.main()
        return pd.read_parquet(Path("data/trials", BAND, f"{METHOD}.parquet"))

    return run


def test_without_landings_the_policys_draws_are_predicted(tried) -> None:
    rows = tried()
    assert rows.kind.tolist() == ["predicted"] * 3
    assert rows.target.tolist() == [1.725, 1.925, 2.125]
    assert rows.landing_y.isna().all() and rows.predicted_y.notna().all()
    assert rows.predicted_speed.gt(0).all() and rows.flight_y.isna().all()


def test_measured_launches_take_their_place(tried) -> None:
    text = (
        f"{HEAD}\n-0.30,-0.17,2.2,1.925,{METHOD}\n-0.30,-0.17,,1.925,{METHOD}\n"
        "-0.31,-0.17,2.3,1.925,\n-0.29,-0.15,1.9,1.725,package_si\n"
    )
    rows = tried(text)
    assert rows.kind.tolist() == ["measured"] * 3
    assert rows.target.fillna(0).tolist() == [1.925, 1.925, 0] and rows.trial.tolist() == [1, 2, 1]
    assert rows.failure.fillna("").tolist() == ["", "did not land", ""]
    assert rows.predicted_y[0] == rows.predicted_y[1] != rows.predicted_y[2]
    assert rows.hold_force.gt(0).all()


def test_landings_of_other_methods_leave_the_policys_own(tried) -> None:
    rows = tried(f"{HEAD}\n-0.30,-0.17,2.2,1.925,package_si\n")
    assert rows.kind.tolist() == ["predicted"] * 3


def test_an_unknown_method_stops_the_stage_and_leaves_what_was_there(tried) -> None:
    before = Path("data/trials", BAND, f"{METHOD}.parquet").read_bytes()
    with pytest.raises(UserError, match="line 2: method 'nobody' is not in params.yaml"):
        tried(f"{HEAD}\n-0.30,-0.17,2.2,1.925,nobody\n")
    assert Path("data/trials", BAND, f"{METHOD}.parquet").read_bytes() == before


@pytest.mark.slow
def test_a_rig_band_is_launched_and_measured_launches_stand_apart(tried) -> None:
    yaml = YAML()
    content = yaml.load(Path("params.yaml"))
    content["run"]["rig"] = [BAND]
    content["bands"][BAND]["source"] = "rig"
    content["rig"]["bands"][BAND] = content["rig"]["bands"]["band1"]
    content["rig"].update(edges=20, tolerance=1e-4)
    content["trials"].update(targets=[1.725, 1.925], repeats=2)
    yaml.dump(content, Path("params.yaml"))
    rows = tried(f"{HEAD}\n-0.30,-0.17,2.2,1.925,{METHOD}\n")
    assert rows.kind.tolist() == ["virtual"] * 4 + ["measured"]
    assert rows.trial.tolist() == [1, 2, 1, 2, 1]
    virtual = rows[:4]
    assert virtual.hold_force.nunique() == 4  # each trial has errors of its own
    for row in virtual.itertuples():
        assert row.flight_z[-1] == pytest.approx(-0.52)
        assert (row.failure is None) == (1.425 <= row.flight_y[-1] <= 2.425)
        assert row.landing_y == row.flight_y[-1]  # where it counts as failed, too
    assert virtual.failure.str.startswith("beyond the area: lands at").all()
    assert rows.flight_y[4] is None and rows.landing_y[4] == 2.2
