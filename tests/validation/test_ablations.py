"""The ablations' campaign: its statistics, its plain searches, and what it makes of results."""

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.identification.search.build import build
from sling2sim2real.identification.search.loop import latin_hypercube
from validation.campaigns.ablations import FIRST, PAPER, Job, jobs_of, summary
from validation.campaigns.variants import LAST, rollouts_of_search, with_preset, with_variants
from validation.paired import compared, holm, mean_interval
from validation.projects import DEFAULTS


def test_holm_is_the_textbook_one() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.7]) == pytest.approx([1, 1])


def test_pairs_are_compared_by_signed_ranks() -> None:
    base = np.arange(10.0)
    shifted = base + 1 + 0.01 * np.arange(10)
    broken = np.where(base < 9, shifted, np.nan)
    comparison = compared({"a": base, "shifted": shifted, "broken": broken, "same": base}, "a")
    assert comparison["shifted"]["p"] == pytest.approx(2 / 2**10)  # all ranks of one sign
    assert comparison["broken"]["n"] == 9
    assert comparison["broken"]["p"] == pytest.approx(2 / 2**9)
    assert comparison["same"]["p_holm"] == 1
    assert comparison["shifted"]["p_holm"] == pytest.approx(3 * 2 / 2**10)
    assert (
        comparison["shifted"]["low"] < comparison["shifted"]["mean"] < comparison["shifted"]["high"]
    )


def test_an_interval_holds_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    confidence = [mean_interval(rng.normal(size=40)) for _ in range(200)]
    inside = np.mean([interval["low"] < 0 < interval["high"] for interval in confidence])
    assert 0.88 < inside < 0.99
    assert mean_interval([np.nan])["mean"] is None


def spent(optimizer, rollouts: int) -> tuple[np.ndarray, list[tuple[str, int]]]:
    """All points of a search of a tilted bowl, and its batches' phases and sizes."""
    points, batches = [], []
    while rollouts > 0:
        requested = optimizer.ask()
        batches.append((optimizer.phase, len(requested)))
        optimizer.tell(bowl(requested))
        points.append(requested)
        rollouts -= len(requested)
    return np.concatenate(points), batches


def bowl(points: np.ndarray) -> np.ndarray:
    return np.sum((points - 0.3) ** 2, axis=1)


def test_plain_starts_explore_alike_and_begin_as_wide_balls() -> None:
    options = {"rollouts": 160, "seed": 4, "population": 10}
    settings = {"generations": 3, "k_top": 2, "delta": 0.1, "cma_population": 60}
    points, batches = spent(build("validation.searches:PlainStarts", 3, **options, **settings), 160)
    explored, _ = spent(build("de", 3, **options), 40)
    assert batches == [("de", 10)] * 4 + [("cma", 120)]
    assert np.array_equal(points[:40], explored)
    centre = explored[np.argmin(bowl(explored))]
    first = points[40:100]  # of the best region's solver; reflected at the box's faces
    assert np.abs(first - centre).std() > 0.1
    assert np.corrcoef(first.T)[np.triu_indices(3, 1)] == pytest.approx(0, abs=0.4)


def test_small_batches_see_every_point() -> None:
    options = {"rollouts": 16, "seed": 1, "population": 8}
    optimizer = build("validation.searches:SmallBatches", 2, **options)
    points, batches = spent(optimizer, 16)
    assert [size for _, size in batches] == [8, 4, 4]
    assert optimizer._points >= len(points)


def test_plain_adam_descends_from_one_point() -> None:
    options = {"rollouts": 240, "seed": 2, "population": 20}
    points, batches = spent(build("validation.searches:PlainAdam", 3, **options), 240)
    assert {size for _, size in batches} == {4}
    assert points[0] == pytest.approx(latin_hypercube(3, 1, 2)[0])
    assert bowl(points[-1:])[0] < 0.01 < bowl(points[:1])[0]


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
    assert len(plain) == 5
    assert all(usual.methods[name] != usual.methods[PAPER] for name in plain)
    assert [rollouts_of_search(params, PAPER) for params in (usual, large)] == [600, 5760]
    assert rollouts_of_search(with_variants(with_preset(default, "bo", "large")), "bo") == 2400
