"""Loss terms on episodes whose offsets are known."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.episode.signal import average, lowpass
from tests.identify.search import toy
from tests.identify.search.toy import loss_of


def test_a_perfect_simulation_costs_nothing_and_one_unit_reads_one() -> None:
    """1 cm away from the camera, by both directions; 1 N in any direction, work along v."""
    episode = toy.episode()
    terms = loss_of(episode).terms(toy.rollouts(episode, count=3))
    for name in ("geom", "force", "work"):
        np.testing.assert_allclose(terms[name], np.zeros(3), atol=1e-2)
    lines = toy.rollouts(episode, shift=(0, 0, -0.01))
    for chamfer in ("symmetric", "measured"):
        terms = loss_of(episode, chamfer=chamfer).terms(lines)
        assert terms["geom"][0] == pytest.approx(1.0, abs=0.01)
    for force in ((1, 0, 0), (0, -1, 0), (0.6, 0, 0.8)):
        terms = loss_of(episode).terms(toy.rollouts(episode, force=force))
        assert terms["force"][0] == pytest.approx(1.0, abs=1e-9)
        duration = (len(episode.time) - 1) * toy.PERIOD
        assert terms["work"][0] == pytest.approx(abs(force[1]) * 0.1 * duration, abs=1e-9)


def test_late_pictures_weigh_less_where_asked() -> None:
    """1 cm off everywhere: the mean weight, by the formula."""
    episode = toy.episode(samples=200, release_time=3.0)
    shifted = toy.rollouts(episode, shift=(0, 0, -0.01))
    late = (episode.cloud_time - 3.0) / toy.PERIOD
    expected = np.mean(1 / (1 + np.exp(0.5 * late)))
    all_of_it, part = (
        loss_of(episode, late_decay=decay).terms(shifted)["geom"][0] for decay in (None, 0.5)
    )
    assert part / all_of_it == pytest.approx(expected, rel=1e-3)
    assert 0.4 < expected < 0.6


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


BLOCKS = np.array([[0.45, 0.75]])  # of the toy's pull, from 0.3 to 1.2 s


def test_a_held_out_block_counts_in_its_own_residuals_alone() -> None:
    """What differs within the block and its guard moves no term, and the other way round."""
    episode = toy.episode(samples=200, release_time=5.9)
    loss = loss_of(episode, held_out=np.array([[2.0, 3.0]]), median_window=1)
    off, late = toy.rollouts(episode), toy.rollouts(episode)
    inside = (off.times > 2.1) & (off.times < 2.9)
    pictures = (off.cloud_time > 2.1) & (off.cloud_time < 2.9)
    off.force[0, inside, 1], off.center_line[0, pictures, :, 2] = 4, -0.01
    late.force[0, off.times > 3.5, 1] = 4
    late.center_line[0, off.cloud_time > 3.5, :, 2] -= 0.01
    clean = loss.terms(toy.rollouts(episode))
    for name in ("geom", "force", "work"):
        assert loss.terms(off)[name][0] == pytest.approx(clean[name][0], abs=1e-3)
        assert loss.terms(late)[name][0] > clean[name][0] + 0.1
    residuals = loss.residuals(off)
    force, cloud = residuals["force"], residuals["cloud"]
    assert force["held_out"][0] == pytest.approx(4 * 0.8, rel=0.05)
    assert cloud["held_out"][0] == pytest.approx(pictures.sum() / loss.held_frames.sum(), rel=0.01)
    assert loss.residuals(late)["force"]["held_out"][0] < 1e-6
    assert force["fitted"][0] < 1e-3 and cloud["fitted"][0] < 0.01


def test_samples_and_frames_are_fitted_or_held_out_and_samples_may_be_guards() -> None:
    loss = loss_of(toy.episode(), held_out=BLOCKS, median_window=1)
    for time, fitted, held in (
        (loss.time, loss.fitted_samples, loss.held_samples),
        (toy.episode().cloud_time, loss.fitted_frames, loss.held_frames),
    ):
        assert not (fitted & held).any()
        np.testing.assert_array_equal(held, (time > 0.45) & (time < 0.75))
    guard = ~(loss.fitted_samples | loss.held_samples)
    assert guard.any()
    assert np.abs(np.abs(loss.time[guard] - 0.6) - 0.15).max() < 0.1
    assert (loss.fitted_frames | loss.held_frames).all()  # clouds pass no filter


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


def test_without_blocks_nothing_is_held_out() -> None:
    episode = toy.episode()
    lines = toy.rollouts(episode, shift=(0.001, 0, -0.01), force=(0.1, 1, 0))
    plain, none = loss_of(episode), loss_of(episode, held_out=np.zeros((0, 2)))
    for name, value in plain.terms(lines).items():
        np.testing.assert_array_equal(none.terms(lines)[name], value)
    residuals = plain.residuals(lines).values()
    assert all(np.isnan(parts["held_out"]).all() for parts in residuals)
