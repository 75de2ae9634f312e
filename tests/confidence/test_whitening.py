"""Effective numbers of correlated residuals, where theory has them."""

import numpy as np
import pytest
from scipy.signal import lfilter

from pipeline.confidence.residuals import Group
from pipeline.confidence.whitening import (
    autocorrelation_time,
    dense,
    discrepant,
    noise_variance,
    weights,
)


def ar1(rng: np.random.Generator, phi: float, shape: tuple[int, ...]) -> np.ndarray:
    """Stationary, variance 1, along the first axis."""
    noise = rng.normal(size=(500 + shape[0], *shape[1:])) * np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], noise, axis=0)[500:]


def group(
    count: int,
    places: int = 1,
    phase: str = "taut",
    first: int = 0,
    channel: str = "force_y",
    part: int = 0,
) -> Group:
    when, where = np.meshgrid(np.arange(count), np.arange(places), indexing="ij")
    grid = np.stack([when.ravel(), where.ravel()], axis=1)
    return Group(channel, phase, part, first + np.arange(count * places), grid)


def independent(group: Group, residual: np.ndarray) -> float:
    """What those of a group alone in its phase are worth."""
    return weights([group], residual)[1][0]["independent"]


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9])
def test_time_of_an_autoregression(phi: float) -> None:
    """(1 + phi) / (1 - phi)."""
    series = ar1(np.random.default_rng(1), phi, (40_000,))
    assert autocorrelation_time(series) == pytest.approx((1 + phi) / (1 - phi), rel=0.1)


def test_an_offset_is_one_residual() -> None:
    assert independent(group(50), np.full(50, 0.3)) == pytest.approx(1.0, abs=0.1)
    assert independent(group(40, 5), np.full(200, 0.3)) == pytest.approx(1.0, abs=0.1)


def test_time_and_band_multiply() -> None:
    """Noise that is correlated a little along both, phi 0.25 and 0.2: 5/3 * 3/2 are worth one."""
    rng = np.random.default_rng(2)
    field = ar1(rng, 0.25, (3000, 60))
    field = lfilter([np.sqrt(1 - 0.04)], [1.0, -0.2], field, axis=1)[:, 20:]
    count = independent(group(*field.shape), field.ravel())
    assert field.size / count == pytest.approx(2.5, rel=0.1)


def test_what_is_smooth_is_worth_one() -> None:
    """A wave along time or along the band; under as much noise it is worth two."""
    rng = np.random.default_rng(7)
    wave = np.tile(np.sin(np.arange(400) / 20)[:, None], (1, 30)) * rng.choice([-1, 1], 30)
    for table in (wave, wave.T):
        assert independent(group(*table.shape), table.ravel()) == pytest.approx(1.0, abs=0.02)
    noisy = wave + rng.normal(0, np.sqrt(0.5), wave.shape)
    assert 2 < independent(group(*wave.shape), noisy.ravel()) < 6


def test_gaps_are_no_residuals() -> None:
    """Every third of an autoregression is missing; pairs across the gaps still count."""
    series = ar1(np.random.default_rng(3), 0.9, (60_000,))
    series[::3] = np.nan
    assert autocorrelation_time(series) == pytest.approx(19, rel=0.4)


def test_dense_puts_residuals_where_they_belong() -> None:
    grid = np.array([[7, 2], [9, 4], [9, 2]])
    table = dense(Group("cloud_side", "swing", 0, np.array([3, 0, 1]), grid), np.arange(4.0))
    np.testing.assert_array_equal(table, [[3, np.nan, np.nan], [np.nan] * 3, [1, np.nan, 0]])


@pytest.mark.parametrize("phi", [0.0, 0.25])
def test_nine_means_of_ten_lie_in_their_interval(phi: float) -> None:
    """A level under correlated noise, 400 times: mean +- 1.645 / sqrt(weights)."""
    rng, count = np.random.default_rng(4), 300
    inside = []
    for _ in range(400):
        series = 5.0 + ar1(rng, phi, (count,))
        weight, _ = weights([group(count)], series - series.mean())
        half = 1.645 / np.sqrt(weight[0] * count)
        inside.append(abs(series.mean() - 5.0) < half)
    assert 0.83 < np.mean(inside) < 0.95


def test_the_recoil_leans_on_the_held_band() -> None:
    """Two frames that happen to fit perfectly do not count for more than the held band's allow."""
    rng = np.random.default_rng(5)
    groups = [group(400), group(4, phase="recoil", first=400)]
    residual = np.concatenate([rng.normal(0, 0.1, 400), np.zeros(4)])
    weight, table = weights(groups, residual)
    assert table[1]["rms"] == 0
    assert 0.05 < table[1]["sigma"] < 0.1
    assert weight[1] < 6 * weight[0]


def test_what_fits_exactly_counts_for_no_more_than_the_noise() -> None:
    """A residual that parameters can bring to nothing says nothing of its own variance."""
    rng = np.random.default_rng(12)
    groups = [group(400), group(1, phase="swing", first=400)]
    weight, table = weights(groups, np.append(rng.normal(0, 0.1, 400), 1e-9))
    assert table[1]["sigma"] == pytest.approx(0.1 / np.sqrt(2), rel=0.1)
    assert weight[1] == pytest.approx(2 * weight[0], rel=0.2)


def test_a_group_that_is_given_up_weighs_no_less() -> None:
    residual = np.random.default_rng(6).normal(0, 1, 100)
    once, _ = weights([group(100)], residual)
    worse, _ = weights([group(100)], 10 * residual, most=np.array([np.mean(residual**2)]))
    assert worse[0] == pytest.approx(once[0])


def test_a_common_offset_is_worth_one_residual_however_many_groups_show_it() -> None:
    """All parts of a phase are off by the same: the level of 1 to 12 groups is no better known."""
    rng = np.random.default_rng(8)
    count, offset = 60, 0.5
    for many in (1, 4, 12):
        groups = [group(count, first=count * i, phase="swing", part=i) for i in range(many)]
        residual = offset + rng.normal(0, 0.02, many * count)
        weight, table = weights(groups, residual)
        assert weight.sum() * count * offset**2 == pytest.approx(1.0, rel=0.02)
        assert sum(one["independent"] for one in table) == pytest.approx(1.0, rel=0.02)


def test_what_exceeds_the_noise_of_the_held_band_is_discrepancy() -> None:
    """Errors that change sign from sample to sample, five times the noise: one residual, not 50."""
    rng = np.random.default_rng(9)
    groups = [group(400), group(50, phase="swing", first=400)]
    residual = np.concatenate([rng.normal(0, 0.1, 400), rng.normal(0, 0.5, 50)])
    _, table = weights(groups, residual)
    assert table[0]["independent"] > 200
    assert 1 < table[1]["independent"] < 2
    assert table[1]["noise"] == pytest.approx(0.1, rel=0.1)


def test_without_discrepancy_all_groups_keep_their_weight() -> None:
    """White noise in 18 groups of a phase, small ones as well: 1 / variance each."""
    rng, sizes = np.random.default_rng(10), [12, 14, 19, 80] * 4 + [200, 1000]
    first = np.cumsum([0, *sizes])
    groups = [
        group(size, first=start, channel=f"force_{i // 4}", part=i % 4)
        for i, (size, start) in enumerate(zip(sizes, first, strict=False))
    ]
    noise = rng.normal(0, 0.3, first[-1])
    weight, table = weights(groups, noise)
    full = sum(one["independent"] for one in table)
    assert full > first[-1] / 2  # as many as estimated correlation times leave
    assert np.median(weight) == pytest.approx(1 / 0.09, rel=0.4)


def test_noise_is_told_from_what_is_smooth() -> None:
    rng = np.random.default_rng(11)
    wave = 3 * np.sin(np.arange(2000) / 100)
    found = noise_variance(group(2000), wave + rng.normal(0, 0.2, 2000))
    assert found == pytest.approx(0.04, rel=0.1)
    assert discrepant(group(2000), wave, float(np.mean(wave**2)), found) > 0.98
    assert np.isnan(noise_variance(group(1), np.ones(1)))
