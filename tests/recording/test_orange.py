"""Facts of a recording that this project did not make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.recording.build import Processed, episode_of, process_recording
from sling2sim2real.settings import BandParams
from tests.project import DEFAULTS, ROOT

FOLDER = ROOT.parent / "shared/recordings"
BAND = BandParams(source="recording", mass=0.0408, diameter=0.010, rest_length=0.52)


def recording(name: str) -> Path:
    if not (file := FOLDER / f"{name}.mcap").exists():
        pytest.skip(f"{file.name} is not beside the project")
    return file


def processed(name: str) -> Processed:
    return process_recording(recording(name), BAND, load(DEFAULTS))[0][0]


@pytest.fixture(scope="module")
def built():
    done = processed("orange")
    return done, episode_of(done, "orange")


@pytest.fixture
def episode(built):
    return built[1]


def test_events_and_force(episode) -> None:
    start = (episode.metadata["input"]["start_ns"] - 1_760_000_000 * 10**9) * 1e-9
    assert start + episode.release_time == pytest.approx(8.0, abs=1e-3)
    assert 0.8 < start + episode.grasp_time < 1.1
    assert episode.metadata["preprocessing"]["peak_force"] == pytest.approx(14.3, abs=0.15)
    assert np.abs(episode.force[episode.time < 0.8]).max() < 0.1
    held = (episode.time > 6.5) & (episode.time < 7.9)
    np.testing.assert_allclose(episode.position[held], [[0, -0.4, 0]] * held.sum(), atol=2e-3)


def test_no_check_fires_on_a_sound_recording(built) -> None:
    assert built[0].findings == []


@pytest.mark.validation
@pytest.mark.parametrize("name", ["orange_2", "orange_3"])
def test_no_check_fires_on_its_other_recordings(name: str) -> None:
    assert processed(name).findings == []


def test_clouds_of_the_drawn_band(built) -> None:
    done, episode = built
    share, offset = done.whole.taut_coverage
    assert share > 0.9 and offset == pytest.approx(0.005, abs=0.002)
    tips = np.array([[-0.1375, 0, 0], [0.1375, 0, 0]])
    hand, near, covered = np.array([0, -0.4, 0]), [], []
    for time, cloud in zip(episode.cloud_time, episode.clouds, strict=True):
        if not 6.2 < time < 7.98:
            continue
        lines = tips[:, None] + np.linspace(0, 0.93, 100)[:, None] * (hand - tips)[:, None]
        gaps = np.linalg.norm(cloud[:, None, None] - lines, axis=-1)
        near.append(gaps.min(axis=(1, 2)) < 0.015)
        covered.append(gaps.min(axis=0) < 0.015)
    assert np.concatenate(near).mean() >= 0.95
    assert np.mean(covered) >= 0.9


def test_every_frame_shows_the_band(episode) -> None:
    assert len(episode.clouds) >= 260
    assert min(len(cloud) for cloud in episode.clouds) > 150
    recoil = (episode.cloud_time > 8.0) & (episode.cloud_time < 8.3)
    for cloud in (c for c, now in zip(episode.clouds, recoil, strict=True) if now):
        assert np.ptp(cloud[:, 0]) > 0.2  # from tip to tip
