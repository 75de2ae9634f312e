"""What is gathered: all that ran, each method's rows in their order."""

from __future__ import annotations

import shutil

import pandas as pd
import pytest

from pipeline.errors import UserError
from pipeline.report.results import gather
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
    with pytest.raises(UserError, match=f"dvc repro ablation_history@{BAND}-de`"):
        gather(params, root)
    for file in (root / "data").glob(f"*/{BAND}/{METHOD}*"):
        copy = file.with_name(file.name.replace(METHOD, "de"))
        shutil.copytree(file, copy) if file.is_dir() else shutil.copy(file, copy)
    assert list(gather(params, root).methods[BAND]) == [METHOD, "de"]
