"""Loss terms on episodes whose offsets are known."""

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.signal import average, lowpass
from tests.identification.objective import toy
from tests.identification.objective.toy import loss_of


def test_a_perfect_simulation_costs_nothing_and_one_unit_reads_one() -> None:
    """1 cm away from the camera, by both directions; 1 N in any direction, work along v."""
    episode = toy.episode()
    terms = loss_of(episode).terms(toy.rollouts(episode, count=3))
    for name in ("geom", "force", "work"):
        np.testing.assert_allclose(terms[name], np.zeros(3), atol=1e-2)
    lines = toy.rollouts(episode, shift=(0, 0, -0.01))
    assert loss_of(episode).terms(lines)["geom"][0] == pytest.approx(1.0, abs=0.01)
    for force in ((1, 0, 0), (0, -1, 0), (0.6, 0, 0.8)):
        terms = loss_of(episode).terms(toy.rollouts(episode, force=force))
        assert terms["force"][0] == pytest.approx(1.0, abs=1e-9)
        duration = (len(episode.time) - 1) * toy.PERIOD
        assert terms["work"][0] == pytest.approx(abs(force[1]) * 0.1 * duration, abs=1e-9)


def test_work_cancels_where_force_does_not() -> None:
    """+1 N on the way out and -1 N on the way back at the same speed: no net work."""
    episode = toy.episode()
    force = np.zeros((60, 3))
    force[:30, 1], force[30:, 1] = 1, -1
    terms = loss_of(toy.episode(force=force)).terms(toy.rollouts(episode))
    assert terms["force"][0] == pytest.approx(1.0)
    assert terms["work"][0] == pytest.approx(0.0, abs=1e-12)


def test_a_simulated_force_goes_the_way_of_a_recorded_one() -> None:
    """The 1 kHz force of a sudden release, recorded and simulated, leaves no difference."""
    episode = toy.episode(samples=100)
    times = np.arange(0, 3.0 + 1e-9, 1e-3)
    raw = np.zeros((len(times), 3))
    raw[:, 1] = np.where((times > 0.3) & (times < 2.4), 12 * np.sin(times), 0)
    recorded = average(times, lowpass(raw, 1000.0, toy.CUTOFF), 0.0, toy.PERIOD, 100)
    episode = toy.episode(samples=100, force=recorded)
    simulated = toy.rollouts(episode)
    simulated.times, simulated.force = times, raw[None]
    terms = loss_of(episode).terms(simulated)
    assert max(terms["force"][0], terms["work"][0]) < 1e-9
    # The unfiltered force is something else: the filter is not left out on both sides.
    unfiltered = average(times, raw, 0.0, toy.PERIOD, 100)
    other = loss_of(toy.episode(samples=100, force=unfiltered), median_window=1).terms(simulated)
    assert other["force"][0] > 1e-3


def test_median_filters_both_sides() -> None:
    """A spike of one sample vanishes; without the filter it counts."""
    force = np.zeros((60, 3))
    force[30, 0] = 60.0
    episode = toy.episode(force=force)
    assert loss_of(episode).terms(toy.rollouts(episode))["force"][0] == 0
    unfiltered = loss_of(episode, median_window=1).terms(toy.rollouts(episode))
    assert unfiltered["force"][0] == pytest.approx(1.0)


def test_empty_frames_are_left_out() -> None:
    """The term is the mean over the frames that show the band; an episode of none is refused."""
    episode = toy.episode(frames=4)
    clouds = [*episode.clouds[:2], np.zeros((0, 3)), np.zeros((0, 3))]
    shifted = toy.rollouts(episode, shift=(0, 0, -0.01))
    some = loss_of(toy.episode(frames=4, clouds=clouds)).terms(shifted)
    np.testing.assert_allclose(some["geom"], loss_of(episode).terms(shifted)["geom"])
    with pytest.raises(UserError, match="no camera frame"):
        loss_of(toy.episode(frames=4, clouds=[np.zeros((0, 3))] * 4))


def test_a_broken_rollout_breaks_no_other() -> None:
    episode = toy.episode()
    pair = toy.rollouts(episode, count=2)
    pair.force[1], pair.center_line[1] = np.nan, np.nan
    loss = loss_of(episode)
    terms = loss.terms(pair)
    np.testing.assert_array_equal(np.isfinite(loss.total(terms)), [True, False])


def test_terms_of_a_rollout_hang_on_no_other_of_its_batch() -> None:
    """To the bit: batches are cut as devices and threads come."""
    rng = np.random.default_rng(3)
    episode = toy.episode(frames=54)
    loss, lines = loss_of(episode), toy.rollouts(episode, count=5)
    lines.center_line[:] += rng.normal(0, 0.01, lines.center_line.shape)
    lines.force[:] += rng.normal(0, 1, lines.force.shape)
    together = loss.terms(lines)
    for first, last in ((0, 1), (1, 3), (3, 5), (4, 5)):
        part = toy.rollouts(episode, count=last - first)
        part.center_line, part.force = lines.center_line[first:last], lines.force[first:last]
        for name, value in loss.terms(part).items():
            np.testing.assert_array_equal(value, together[name][first:last])
