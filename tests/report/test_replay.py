"""The replay against the rollout that it filters and samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from pipeline.episode import Episode
from pipeline.params import load
from pipeline.report.replay import replay
from pipeline.sling.interaction import interact
from pipeline.sling.model import Sling

THETA = np.array([3e5, 0.46, 4e-3, 0.5, 0.6])


@pytest.fixture(scope="module")
def played():
    """A hand that takes the hanging band at 1 s, draws it 0.3 m by 3 s and lets go at 4 s."""
    params = load()
    time = (np.arange(160) + 0.5) * 0.03
    knots = np.array([[0, 0, -0.2], [0, 0, -0.2], [0, 0, 0], [0, -0.3, 0], [0, -0.3, 0]])
    path = PchipInterpolator([0, 1, 2, 3, 5], knots)(time)
    nothing, stamps = np.zeros((160, 3)), np.arange(20) * 0.24
    episode = Episode(
        "band1", time, path, nothing, nothing, 0 * time, stamps, [], 1.0, 4.0, np.ones(3)
    )
    band = params.bands["band1"]
    rollouts = interact(Sling.of(band, params.setup, params.sling), episode, THETA[None])
    return episode, rollouts, replay(params, "band1", episode, THETA)


def test_the_pause_keeps_the_force_and_nothing_pulls_before_or_after(played) -> None:
    episode, rollouts, played = played
    held = rollouts.force[0, np.searchsorted(rollouts.times, 3.7), 1]
    pause = (episode.time > 3.5) & (episode.time < 3.9)
    assert held > 3 and played.force.shape == (160, 3)
    np.testing.assert_allclose(played.force[pause, 1], held, rtol=0.01)
    free = (episode.time < 0.9) | (episode.time > 4.1)
    assert np.abs(played.force[free]).max() < 0.02 * held


def test_the_filter_does_not_delay_the_release(played) -> None:
    episode, _, played = played
    force = played.force[:, 1]
    half = force[episode.time < 3.9].max() / 2
    after = np.flatnonzero((force < half) & (episode.time > 3.5))[0]
    assert abs(episode.time[after] - 4.0) <= 0.03


def test_the_bands_ends_stay_at_the_tips(played) -> None:
    _, rollouts, played = played
    assert played.center_line.shape == rollouts.center_line.shape[1:]
    ends = played.center_line[:, [0, -1]]
    np.testing.assert_allclose(np.abs(ends), np.broadcast_to([0.1375, 0, 0], ends.shape), atol=2e-3)
