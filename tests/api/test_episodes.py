"""Episodes of arrays are filtered and cut as a recording's; wrong arrays are refused by name."""

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real import Band, Episode, Settings, episode_from_arrays, read_mcap
from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.build import build_episodes
from tests.api.toy import still
from tests.project import DEFAULTS
from tests.recording.conftest import written


def test_samples_are_means_on_the_windows_clock() -> None:
    time = np.arange(0, 12, 1e-3) + 100.0  # the rig's own clock
    arrays = still(time, release=110.0)
    arrays["position"][:, 0] = 0.1 * (time - 100)
    arrays["force"][:, 2] = np.where(time < 106, 1.0, 3.0)
    episode = episode_from_arrays(**arrays)
    start = 110 + 0.7 - 9.0
    assert np.allclose(np.diff(episode.time), 0.03) and len(episode.time) == 300
    assert episode.release_time == pytest.approx(110 - start)
    assert episode.grasp_time == pytest.approx(102 - start)
    assert np.allclose(episode.position[:, 0], 0.1 * (episode.time + start - 100))
    assert np.allclose(episode.velocity[:, 0], 0.1)
    force = np.interp([2.0, 106 - start, 6.0], episode.time, episode.force[:, 2])
    assert np.allclose(force, [1, 2, 3], atol=0.2)  # low-passed without delay
    assert episode.force[:, 2].mean() == pytest.approx((4.3 * 1 + 4.7 * 3) / 9, rel=1e-3)
    assert np.allclose(np.diff(episode.cloud_time), 0.1)
    assert 0 <= episode.cloud_time[0] < 0.1 and episode.cloud_time[-1] <= 9.0


def test_a_short_recording_has_fewer_samples() -> None:
    time = np.arange(0, 5, 1e-3)
    episode = episode_from_arrays(**still(time, release=4.0))
    assert len(episode.time) == 166 and episode.time[0] == pytest.approx(0.015)


def test_a_force_of_another_rate_and_a_gripper() -> None:
    time = np.arange(0, 5, 0.01)
    arrays = still(time, release=4.0)
    fast = np.arange(0, 5, 1e-3)
    arrays |= {"force_time": fast, "force": np.tile([0, 10.0, 0], (len(fast), 1))}
    episode = episode_from_arrays(**arrays, opening=np.full(len(time), 0.01), release_error=2e-3)
    assert np.allclose(episode.force, [0, 10, 0]) and np.allclose(episode.opening, 0.01)
    assert episode.metadata["preprocessing"]["release_error"] == 2e-3


def test_large_clouds_are_thinned_and_episodes_are_kept(tmp_path) -> None:
    arrays = still(np.arange(0, 5, 1e-3), release=4.0)
    arrays["clouds"][5] = np.random.default_rng(0).random((5000, 3))
    episode = episode_from_arrays(**arrays, settings=Settings.default(cloud={"points": 100}))
    assert len(episode.clouds[5]) == 100
    episode.save(tmp_path)
    assert np.array_equal(Episode.load(tmp_path).force, episode.force)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"position": np.zeros((7, 2))}, r"position: must have shape \(5000, 3\), got \(7, 2\)"),
        ({"force": np.tile([0, -10.0, 0], (5000, 1))}, "turn its sign"),
        ({"force": np.zeros((5000, 3))}, "0.5 N or more are expected"),
        ({"time": np.zeros(5000)}, "time: must be at least ten increasing times"),
        ({"grasp_time": 4.5}, "must be after grasp_time"),
        ({"release_time": 4.5}, "record until 0.7 s"),
        ({"grasp_time": -1.0}, "too late for the grasp at -1.00 s"),
    ],
)
def test_wrong_arrays_are_refused_by_name(wrong: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        episode_from_arrays(**still(np.arange(0, 5, 1e-3), release=4.0) | wrong)


def test_an_mcap_is_read_as_the_pipeline_reads_it(tmp_path_factory) -> None:
    path, _ = written(tmp_path_factory, "seen.mcap")
    window = {"duration": 3.6, "samples": 120, "tail": 0.5}
    theirs = load(DEFAULTS)
    theirs = theirs.model_copy(update={"episode": theirs.episode.model_copy(update=window)})
    band_params = theirs.bands["band1"]
    band = Band(band_params.mass, band_params.diameter, band_params.rest_length, name="mine")
    ours = read_mcap(path, band, settings=Settings.default(episode=window))
    expected, _ = build_episodes(path, "band1", theirs)
    assert len(ours) == len(expected) == 1
    assert np.array_equal(ours[0].force, expected[0].force)
    assert all(map(np.array_equal, ours[0].clouds, expected[0].clouds))
    assert ours[0].band == "mine"
