"""The ablations' campaign: its statistics, its plain searches, and what it makes of results."""

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.identification.objective.box import latin_hypercube
from sling2sim2real.identification.searches.de import differential_evolution
from tests.identification.searches.functions import batches_of
from validation.campaigns.ablations import FIRST, PAPER, Job, jobs_of, summary
from validation.campaigns.variants import LAST, rollouts_of_search, with_preset, with_variants
from validation.paired import compared, mean_interval
from validation.projects import DEFAULTS
from validation.searches import plain_adam, plain_starts, small_batches


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


def bowl(points: np.ndarray) -> np.ndarray:
    return np.sum((points - 0.3) ** 2, axis=1)


def test_plain_starts_explore_alike_and_begin_as_wide_balls() -> None:
    options = {"seed": 4, "population": 10}
    settings = {"generations": 3, "k_top": 2, "delta": 0.1, "cma_population": 60}
    batches = batches_of(plain_starts, bowl, 3, 160, **options, **settings)
    explored = np.concatenate(batches_of(differential_evolution, bowl, 3, 40, **options))
    assert [len(batch) for batch in batches] == [10] * 4 + [120]
    assert np.array_equal(np.concatenate(batches[:4]), explored)
    centre = explored[np.argmin(bowl(explored))]
    first = batches[4][:60]  # of the best region's solver; reflected at the box's faces
    assert np.abs(first - centre).std() > 0.1
    assert np.corrcoef(first.T)[np.triu_indices(3, 1)] == pytest.approx(0, abs=0.4)


def test_small_batches_are_of_four() -> None:
    batches = batches_of(small_batches, bowl, 2, 16, seed=1, population=8)
    assert [len(batch) for batch in batches] == [8, 4, 4]


def test_plain_adam_descends_from_one_point() -> None:
    batches = batches_of(plain_adam, bowl, 3, 240, seed=2, population=20)
    assert {len(batch) for batch in batches} == {4}
    assert batches[0][0] == pytest.approx(latin_hypercube(3, 1, 2)[0])
    assert bowl(batches[-1])[0] < 0.01 < bowl(batches[0])[0]


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
    ours = band["methods"][PAPER]
    assert ours["miss_cm"]["mean"] == pytest.approx(1.5)  # 1 and 2 cm
    assert ours["bias_cm"]["mean"] == pytest.approx(0)
    assert ours["seeds_on_one_recording"]["mean"] == pytest.approx(2)  # 1, 2 and 3 cm
    assert (ours["run"], ours["without_landing"], ours["targets_out_of_reach"]) == (3, 1, 2)
    assert band[f"less_{PAPER}"]["bo"]["mean"] == pytest.approx(3)
    assert band[f"less_{PAPER}"]["bo"]["n"] == 2


def test_jobs_are_distinct_and_the_slow_ones_last() -> None:
    jobs = jobs_of(["band1", "band2"], [LAST, PAPER], 10, 5)
    assert len({*jobs}) == len(jobs) == 2 * 2 * (10 + 4)
    assert all(job.method == LAST for job in jobs[28:])


def test_each_variant_changes_what_its_name_says_and_a_preset_the_budget() -> None:
    default = load(DEFAULTS)
    usual, large = (with_variants(with_preset(default, PAPER, name)) for name in (None, "large"))
    plain = usual.methods.keys() - default.methods.keys()
    assert len(plain) == 6
    assert all(usual.methods[name] != usual.methods[PAPER] for name in plain)
    assert [rollouts_of_search(params, PAPER) for params in (usual, large)] == [600, 5760]
    assert rollouts_of_search(with_variants(with_preset(default, "bo", "large")), "bo") == 2400
