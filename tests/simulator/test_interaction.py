"""The recorded interaction: parameters, friction, robustness, independence of the batch."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.simulator import THETA, interact
from tests.simulator.bands import BASE, BOX, neo, random_thetas


def test_every_parameter_changes_the_episode(sling, episode):
    others = np.tile(BASE, (5, 1))
    for k in range(5):
        others[k, k] = 2 * BASE[k] if k in (0, 2) else BOX[k].mean()
    rollouts = interact(sling, episode, neo(np.array([BASE, *others])))
    assert rollouts.failure == [None] * 6
    force = np.abs(rollouts.force[1:] - rollouts.force[0]).max((1, 2))
    line = np.abs(rollouts.center_line[1:] - rollouts.center_line[0]).max((1, 2, 3))
    for name, changes in zip(THETA, (force > 0.01) | (line > 1e-3), strict=True):
        assert changes, name


def test_hand_and_clamps_hold_the_band_and_force_ends_with_the_release(sling, episode):
    rollouts = interact(sling, episode, neo(BASE))
    assert rollouts.failure == [None]
    time, line, force = rollouts.cloud_time, rollouts.center_line[0], rollouts.force[0]
    held = (time > 1.0) & (time < 2.35)
    hand = [np.interp(time, episode.time, column) for column in episode.position.T]
    assert np.abs(line[:, sling.middle] - np.transpose(hand))[held].max() < 2e-3
    ends = np.broadcast_to(sling.tips, (len(time), 2, 3))
    assert line[:, [0, -1]] == pytest.approx(ends, abs=1e-6)
    assert np.all(force[rollouts.times < episode.grasp_time] == 0)
    clear = episode.release_time + sling.finger_opening_time
    assert np.all(force[rollouts.times > clear + 1e-6] == 0)
    full = np.argmin(np.abs(rollouts.times - 2.3))
    assert force[full, 1] > 5 and abs(force[full, 0]) < 0.05


def test_weak_pads_lose_the_band_during_the_pull(sling, episode):
    theta = BASE.copy()
    theta[3] = 0.05
    assert interact(sling, episode, neo(theta)).failure == ["the band slipped out of the fingers"]


def test_more_friction_lets_go_faster(sling, episode):
    """The pads' grip on the band dies at 2 mu N / T from the pull at the release."""
    theta = np.array([BASE, BASE])
    theta[:, 3] = 0.4, 0.8
    rollouts = interact(sling, episode, neo(theta))
    force = np.linalg.norm(rollouts.force, axis=2)
    at = np.argmin(np.abs(rollouts.times - episode.release_time))
    late = np.argmin(np.abs(rollouts.times - episode.release_time - 0.001))
    for row, friction in enumerate(theta[:, 3]):
        rate = 2 * friction * sling.grip_force / sling.finger_opening_time
        lapse = rollouts.times[late] - episode.release_time
        expected = max(force[row, at] - rate * lapse, 0)
        assert force[row, late] == pytest.approx(expected, abs=0.02)


def test_result_depends_on_neither_neighbours_nor_workers(sling, episode):
    thetas = random_thetas(20, seed=3)
    together = interact(sling, episode, neo(thetas), workers=2)
    alone = interact(sling, episode, neo(thetas[7]))
    assert np.array_equal(together.force[7], alone.force[0])
    assert np.array_equal(together.center_line[7], alone.center_line[0])


def test_finer_steps_give_the_same_recoil(sling, episode):
    coarse = interact(sling, episode, neo(BASE))
    fine = interact(sling, episode, neo(BASE), refine=5, double=True)
    recoil = (coarse.cloud_time > 2.4) & (coarse.cloud_time < 2.47)
    gap = np.linalg.norm(coarse.center_line - fine.center_line, axis=3)[0]
    assert gap[recoil].max() < 4e-3
    held = (coarse.cloud_time > 2.2) & (coarse.cloud_time < 2.4)
    assert gap[held].max() < 1e-3


def test_release_time_moves_the_recoil(sling, episode):
    later = replace(episode, release_time=episode.release_time + 0.01)
    lines = [interact(sling, e, neo(BASE)).center_line[0] for e in (episode, later)]
    frame = np.searchsorted(episode.cloud_time, 2.43)
    assert lines[0][frame, sling.middle, 1] > lines[1][frame, sling.middle, 1] + 0.01
