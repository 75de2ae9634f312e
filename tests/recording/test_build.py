"""Episodes of recordings whose truth is a formula."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.signals import signals_of
from tests.project import with_
from tests.recording.conftest import processed_of, pull_of
from validation.recordings.bag import EYE, RADIUS, Truth, blind_bag, edit


def signals(path, params):
    return signals_of(pull_of(path, params), params)


def test_force_and_motion(episode, seen) -> None:
    truth = seen[1]
    t = episode.time
    calm = np.abs(t - truth.release) > 0.06  # where the low pass does not smear the drop
    force = np.array([truth.force(time) for time in t])
    np.testing.assert_allclose(episode.force[calm], force[calm], atol=0.15)  # 20 N, and a kink
    assert episode.force[:, 1].max() > 15
    hand = np.array([truth.hand(time) for time in t])
    np.testing.assert_allclose(episode.position, hand, atol=3e-4)
    speed = np.array([(truth.hand(x + 1e-4) - truth.hand(x - 1e-4)) / 2e-4 for x in t])
    np.testing.assert_allclose(episode.velocity, speed, atol=0.025)
    np.testing.assert_allclose(episode.camera, EYE, atol=1e-9)


def test_events(episode, seen) -> None:
    truth = seen[1]
    assert episode.release_time == pytest.approx(truth.release, abs=1e-3)
    assert episode.grasp_time == pytest.approx(truth.grasp, abs=0.021)
    assert episode.opening[0] == pytest.approx(0.08) and episode.opening[60] == pytest.approx(0.016)


def test_clouds_lie_on_the_band_and_cover_it(episode, checked, seen) -> None:
    assert len(episode.clouds) == 54
    lines = [seen[1].center_line(time) for time in episode.cloud_time]
    off = np.concatenate(
        [cKDTree(line).query(cloud)[0] for line, cloud in zip(lines, episode.clouds, strict=True)]
    )
    assert np.median(np.abs(off - RADIUS)) <= 0.003 and np.mean(off < 0.025) > 0.95
    assert checked.taut_coverage[0] >= 0.9


@pytest.mark.parametrize(
    ("truth", "words"),
    [
        (Truth(end=3.3), "after the release"),
        (Truth(grasp=0.1, lifted=0.6), "empty hand"),
        (Truth(stiffness=0.0), "no release"),
        (Truth(draw=0.02, stiffness=400.0), "not behind the fork|no release"),
    ],
)
def test_recordings_that_cannot_be_used(tmp_path, params, truth, words) -> None:
    path = blind_bag(tmp_path, truth)
    with pytest.raises(UserError, match=words) as caught:
        processed_of(path, params)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


def test_a_window_that_is_too_long_or_too_short(blind, params) -> None:
    for duration, words in ((8.0, "record for longer"), (1.5, "pull faster")):
        with pytest.raises(UserError, match=words):
            signals(blind[0], with_(params, "episode", duration=duration, longest=duration))


def test_a_wrong_frame_of_the_wrench_is_noticed(tmp_path, params) -> None:
    def rename(stamp: int, message) -> None:
        message.header.frame_id = "base"  # it is not: the values are the sensor's

    path = blind_bag(tmp_path, change=edit(wrench=rename))
    with pytest.raises(UserError, match="away from the fork"):
        signals(path, params)


def test_bytes_are_reproducible_and_come_back(episode, seen, params, tmp_path) -> None:
    episode.save(tmp_path / "a")
    build_episodes(seen[0], "band1", params)[0][0].save(tmp_path / "b")
    for name in ("signals.parquet", "clouds.parquet"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    back = Episode.load(tmp_path / "a")
    np.testing.assert_array_equal(back.force, episode.force)
    np.testing.assert_array_equal(back.clouds[50], episode.clouds[50])
    assert back.metadata == json.loads(json.dumps(episode.metadata))
    assert back.metadata["input"]["topics"]["wrench"] == "/ft/wrench"
