"""One device against several: what is timed, and that a difference is seen."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.params import load
from tests.project import DEFAULTS
from validation.benchmarks import scaling as bench

PARAMS = load(DEFAULTS)
SMALL = {"population": 6, "generations": 1, "cma_population": 4, "cma_rollouts": 4, "k_top": 1}


def test_the_same_work_on_one_and_on_two(monkeypatch) -> None:
    monkeypatch.setattr(bench, "GENERATIONS", (5,))
    monkeypatch.setattr(bench, "LAUNCHES", (4,))
    monkeypatch.setitem(bench.BUDGETS, "laptop", SMALL)
    result = bench.scaling(PARAMS, ["cpu"] * 2, None, "sling2sim2real", "laptop")
    parts = result["scaling"]
    rows = [*parts["generations"], *parts["launches"], parts["search"]]
    assert [row.get("rollouts") or row.get("launches") for row in rows] == [5, 4, None]
    for row in rows:
        assert [device["count"] for device in row["devices"]] == [1, 2]
        assert all(device["equal"] and device["seconds"] > 0 for device in row["devices"])
        assert row["devices"][0]["speedup"] == 1
    assert parts["search"]["one_device"]["rollouts"] == 16
    assert "NOT EQUAL" not in bench.table(result)
    parts["search"]["devices"][1]["equal"] = False
    assert bench.table(result).endswith("NOT EQUAL")


def test_it_counts_in_twos() -> None:
    assert [bench._counts(most) for most in (2, 3, 8)] == [[1, 2], [1, 2, 3], [1, 2, 4, 8]]


def test_another_number_or_failure_is_a_difference() -> None:
    values = np.array([1.0, np.nan, np.inf])
    assert bench._same(values, values.copy())
    assert not bench._same(values, np.array([np.nextafter(1.0, 2), np.nan, np.inf]))
    assert not bench._same(np.array(["None"]), np.array(["too far"]))


def test_one_device_is_refused() -> None:
    with pytest.raises(UserError, match="compares several GPUs.*cpu is one"):
        bench.bench_scaling(PARAMS, "cpu")
