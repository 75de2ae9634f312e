"""What is gathered: all that ran, each method's rows in their order."""

from __future__ import annotations

import json
import shutil
from types import SimpleNamespace

import pandas as pd
import pytest

from pipeline.base.errors import UserError
from pipeline.report.results import gather, pairs
from tests.report.conftest import BAND, METHOD


def test_a_search_of_one_phase_has_no_refinement(root, params) -> None:
    result = gather(params, root).methods[BAND][METHOD]
    assert result.history.phase.tolist() == ["de"] * 3 + ["cma"] * 2
    file = root / "data" / "refined" / BAND / f"{METHOD}.parquet"
    pd.read_parquet(file).iloc[:0].to_parquet(file)
    alone = gather(params, root).methods[BAND][METHOD]
    assert alone.history.phase.tolist() == ["de"] * 3
    assert alone.history.total.dtype == result.history.total.dtype == float
    assert alone.history.solver.isna().all()


def test_intervals_are_those_of_the_theta_file(root, params) -> None:
    result = gather(params, root).methods[BAND][METHOD]
    low = result.confidence["parameters"]["poissons_ratio"]["low"]
    assert low == pytest.approx(0.9 * 0.45) and len(result.posterior["samples"]) == 41


def test_further_methods_run_on_some_bands_only(root, params) -> None:
    run = params.run.model_copy(
        update={
            "ablations": params.run.ablations.model_copy(
                update={"bands": (BAND,), "methods": ("de",)}
            )
        }
    )
    params = params.model_copy(update={"run": run})
    with pytest.raises(UserError, match=f"history/{BAND}/de.parquet: missing"):
        gather(params, root)
    for file in (root / "data").glob(f"*/{BAND}/{METHOD}*"):
        copy = file.with_name(file.name.replace(METHOD, "de"))
        shutil.copytree(file, copy) if file.is_dir() else shutil.copy(file, copy)
    assert list(gather(params, root).methods[BAND]) == [METHOD, "de"]


def test_ablations_run_on_their_bands_only() -> None:
    ablations = SimpleNamespace(bands=("b",), methods=("c",))
    run = SimpleNamespace(bands=("a", "b"), methods=("x", "y"), ablations=ablations)
    assert pairs(run) == [("a", "x"), ("a", "y"), ("b", "x"), ("b", "y"), ("b", "c")]


def test_robust_launches_stand_apart(root, params) -> None:
    file = root / "data" / "trials" / BAND / f"{METHOD}.parquet"
    plain = pd.read_parquet(file)
    second = plain.assign(policy="robust", landing_y=2.0)
    pd.concat([plain.assign(policy="plain"), second]).to_parquet(file)
    result = gather(params, root).methods[BAND][METHOD]
    assert len(result.trials) == len(result.robust_trials) == len(plain)
    assert (result.robust_trials.landing_y == 2.0).all() and result.robust_card is None
    assert result.trials.index.tolist() == result.robust_trials.index.tolist()
    card = root / "data" / "policies" / BAND / METHOD / "robust" / "card.json"
    card.parent.mkdir()
    card.write_text('{"kind": "robust"}')
    assert gather(params, root).methods[BAND][METHOD].robust_card == {"kind": "robust"}


def test_a_band_of_the_rig_has_a_floor(root, params) -> None:
    run = params.run.model_copy(update={"rig": (BAND,)})
    virtual = params.model_copy(update={"run": run})
    assert gather(params, root).floors == {}
    with pytest.raises(UserError, match=f"floor/{BAND}.json: missing"):
        gather(virtual, root)
    (root / "data" / "floor").mkdir()
    floor = {
        "band": BAND, "mean_error_m": 0.02, "launches": 5, "actuation_error_m": 1e-3,
        "release_jitter": 0.02, "targets": {"1.725": {"mean_error_m": 0.02}},
    }  # fmt: skip
    (root / "data" / "floor" / f"{BAND}.json").write_text(json.dumps(floor))
    assert gather(virtual, root).floors == {BAND: floor}


def test_measured_launches_of_a_method_that_does_not_run_are_counted(root, params) -> None:
    folder = root / "data" / "trials" / "measured"
    folder.mkdir()
    assert gather(params, root).unused == {}
    rows = [METHOD, "", "de", "de", "bo"]
    lines = [f"-0.3,-0.2,1.9,1.9,{method}" for method in rows]
    text = "\n".join(["draw_y_m,draw_z_m,landing_y_m,target_m,method", *lines])
    (folder / f"{BAND}.csv").write_text(text + "\n")
    assert gather(params, root).unused == {BAND: 3}
