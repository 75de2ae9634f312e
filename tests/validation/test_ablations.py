"""The ablations' campaign: its statistics, and what it makes of results."""

import numpy as np
import pytest

from validation.campaigns.ablations import FIRST, PAPER, Job, jobs_of, summary
from validation.paired import compared, mean_interval


def test_pairs_are_compared_where_both_are_there() -> None:
    base = np.arange(10.0)
    shifted = base + 1 + 0.01 * np.arange(10)
    broken = np.where(base < 9, shifted, np.nan)
    comparison = compared({"a": base, "shifted": shifted, "broken": broken, "same": base}, "a")
    assert comparison.keys() == {"shifted", "broken", "same"}
    assert comparison["shifted"]["mean"] == pytest.approx(1.045)
    assert comparison["shifted"]["low"] < 1.045 < comparison["shifted"]["high"]
    assert (comparison["broken"]["n"], comparison["same"]["mean"]) == (9, 0)


def test_an_interval_holds_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    confidence = [mean_interval(rng.normal(size=40)) for _ in range(200)]
    inside = np.mean([interval["low"] < 0 < interval["high"] for interval in confidence])
    assert 0.88 < inside < 0.99
    assert mean_interval([np.nan])["mean"] is None


def results(offset: dict[str, float]) -> list[dict]:
    """Of every job of two recordings of a band, misses of 1, 2, ... cm and a method's offset."""
    rows = []
    for job in jobs_of(["band1"], [*offset], 2, 3):
        miss = 0.01 * (job.recording - FIRST + job.seed + offset[job.method])
        result = {"theta": {"youngs_modulus": 2e5}, "loss": None, "seconds": 1.0}
        rows.append(vars(job) | result | {"error_m": [miss, -miss, None]})
    return rows


def test_a_summary_pairs_recordings_and_spreads_seeds() -> None:
    methods = [PAPER, "bo"]
    of = results({PAPER: 0, "bo": 3})
    of.append(vars(Job("band1", FIRST + 2, PAPER, 1)) | {"failed": "no simulation"})
    band = summary(of, ["band1"], methods)["band1"]
    paper = band["methods"][PAPER]
    assert paper["miss_cm"]["mean"] == pytest.approx(1.5)  # 1 and 2 cm
    assert paper["bias_cm"]["mean"] == pytest.approx(0)
    assert paper["seeds_on_one_recording"]["mean"] == pytest.approx(2)  # 1, 2 and 3 cm
    assert (paper["run"], paper["without_landing"], paper["targets_out_of_reach"]) == (3, 1, 2)
    assert band[f"less_{PAPER}"]["bo"]["mean"] == pytest.approx(3)
    assert band[f"less_{PAPER}"]["bo"]["n"] == 2
