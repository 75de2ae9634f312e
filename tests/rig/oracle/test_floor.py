import numpy as np

from rig.oracle.floor import errors_of, trial_numbers


def test_numbers_begin_with_the_trials_own(params) -> None:
    """Those of stages/trials.py: launches are numbered target by target."""
    repeats, count = params.trials.repeats, len(params.trials.targets)
    numbers = trial_numbers(params)
    expected = np.arange(count * repeats)
    assert numbers.shape == (count, repeats + params.floor.launches)
    assert np.array_equal(numbers[:, :repeats].ravel(), expected)
    assert len(np.unique(numbers)) == numbers.size


def test_a_floor_counts_what_failed_and_averages_the_rest(params) -> None:
    targets = np.array(params.trials.targets)
    misses = np.tile([0.01, -0.03, 0.02, 0.0, -0.01, 0.04], (len(targets), 1))
    misses[1, 2] = np.nan
    draws = np.array([[-0.3, -0.1 * n] for n in range(len(targets))])
    floor = errors_of(draws, targets[:, None] + misses, params)
    first, second = (floor["targets"][f"{target:g}"] for target in targets[:2])
    assert first["draw"] == [-0.3, 0.0]
    assert np.isclose(first["mean_error_m"], 0.11 / 6) and np.isclose(first["bias_m"], 0.03 / 6)
    assert np.isclose(first["std_m"], np.std(np.abs(misses[0]), ddof=1))
    assert np.isclose(
        first["trials_mean_error_m"], np.abs(misses[0, : params.trials.repeats]).mean()
    )
    assert (second["launches"], second["failed"]) == (6, 1)
    assert (floor["launches"], floor["failed"]) == (6 * len(targets), 1)
    assert np.isclose(floor["mean_error_m"], np.nanmean(np.abs(misses)))
    none = errors_of(draws * np.nan, np.full(misses.shape, np.nan), params)
    assert none["mean_error_m"] is None and none["failed"] == none["launches"]
    assert [row["draw"] for row in none["targets"].values()] == [None] * len(targets)
