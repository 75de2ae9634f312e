"""The campaign of the slack swing: which pictures tell of damping, where damping is known."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.episode.signal import cutoff_hz
from pipeline.simulator.model import LaunchSetup
from pipeline.simulator.parameters import Parameters
from validation.campaigns.swing import PARTS, D, S, SplitPictures, _damped, landed
from validation.synthetic import own_law_episode, pull_and_release

THETA = Parameters.of("neo_hookean", [2.2e5, 0.45, 3e-3, 0.9, 0.8])


@pytest.fixture(scope="module")
def episode(params, sling):
    """Whose band has THETA; five of its pictures, 1/30 s apart, are before the release."""
    plan = pull_and_release("band1", params.episode, sling)
    stamps = plan.release_time + np.arange(-5, 25) / 30 + 0.01
    plan = replace(plan, cloud_time=stamps, clouds=[np.zeros((0, 3), np.float32)] * len(stamps))
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    return own_law_episode(sling, plan, THETA, cutoff=cutoff, depth_noise=0.0)


def test_the_pictures_of_every_part_after_the_release_show_the_true_damping(
    params, sling, episode
) -> None:
    true = THETA.column(D)[0] * THETA.column(S)[0]
    dampings = true * np.array([0.25, 0.5, 1.0, 2.0, 4.0])
    done = SplitPictures(params, episode, sling, _damped(THETA, dampings))
    assert done.count == {"pull": 5, "taut": 2, "swing": 13, "later": 10}
    assert np.argmin(done.total) == 2
    assert {part: np.argmin(done.mean[part]) for part in [*PARTS][1:]} == {
        "taut": 2,
        "swing": 2,
        "later": 2,
    }
    assert (np.diff(done.reach) < 0).all()  # what is damped more swings less far
    assert np.ptp(done.mean["pull"]) < 0.01 * np.ptp(done.mean["swing"])


def test_launches_are_those_of_each_point(params, sling) -> None:
    setup = LaunchSetup.of(params.setup, params.sling)
    points = _damped(THETA, [1e-3, 4e-3])
    together = landed(sling, setup, points)
    assert together.shape == (2, 3)
    np.testing.assert_array_equal(together[1:], landed(sling, setup, points[1:]))
    assert (together[0] > together[1]).all()
