"""What is gathered: all that ran, each method's rows in their order; the printed loss of them."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from pipeline.launching.trials.measured import Measured, save_scores
from pipeline.report.run.results import PRINTED, best_so_far, gather, has_another_loss, printed
from tests.project import with_
from tests.report.run.conftest import BAND, METHOD


def test_further_methods_run_on_some_bands_only(root, params) -> None:
    plain, params = params, with_(params, "run.ablations", bands=(BAND,), methods=("de",))
    with pytest.raises(UserError, match=f"evaluations/{BAND}/de.parquet: missing"):
        gather(params, root)
    for file in (root / "data").glob(f"*/{BAND}/{METHOD}*"):
        copy = file.with_name(file.name.replace(METHOD, "de"))
        shutil.copytree(file, copy) if file.is_dir() else shutil.copy(file, copy)
    assert list(gather(params, root).methods[BAND]) == [METHOD, "de"]
    assert list(gather(plain, root).methods[BAND]) == [METHOD]


def test_a_band_of_the_rig_has_a_floor(root, params) -> None:
    virtual = with_(params, "run", rig=(BAND,))
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
    assert gather(params, root).unused == {}
    methods = [METHOD, "", "de", "de", "bo"]
    launch = {"draw": (-0.3, -0.2), "landing": 1.9, "target": 1.9}
    launches = [Measured(**launch, method=method) for method in methods]
    save_scores(Layout(root).scores(BAND), launches)
    assert gather(params, root).unused == {BAND: 3}


def rows(total, geom, force=0.0, work=0.0) -> pd.DataFrame:
    columns = np.broadcast_arrays(total, geom, force, work)
    return pd.DataFrame(dict(zip(("total", *PRINTED), columns, strict=True)))


def test_the_best_by_another_loss_may_print_worse() -> None:
    history = rows([np.inf, 3, 5, 2, 2, 1], [np.nan, 1, 0.5, 4, 9, 2], force=0.5, work=0.25)
    best = best_so_far(history)
    assert best.tolist() == [0, 1, 1, 3, 3, 5]  # among equals the first
    np.testing.assert_allclose(printed(history)[best], [np.inf, 1.75, 1.75, 4.75, 4.75, 2.75])


@given(st.lists(st.floats(0, 9) | st.just(np.inf), min_size=1, max_size=40))
def test_the_methods_own_best_never_rises(total: list[float]) -> None:
    best = np.array(total)[best_so_far(rows(total, 0.0))]
    np.testing.assert_array_equal(best, np.minimum.accumulate(total))


def test_which_weights_are_the_printed_ones() -> None:
    ones = {"geom": 1, "force": 1, "work": 1}
    assert not has_another_loss(ones)
    for another in ({"work": 0}, {"geom": 2}):
        assert has_another_loss(ones | another)
