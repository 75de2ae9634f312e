"""The recorded interaction: parameters, friction, robustness, independence of the batch."""

import numpy as np
import pytest

from sling2sim2real.simulator import interact
from tests.simulator.bands import BASE, neo, random_thetas


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
