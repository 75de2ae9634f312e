"""Loss terms on episodes whose offsets are known, and against NumPy's sums."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import median_filter

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import gpus
from sling2sim2real.base.native import start, wp
from sling2sim2real.episode.signal import average, lowpass
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import TERMS, EpisodeLoss
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.replay import recorded_force
from tests.identification.objective import toy
from tests.identification.objective.toy import loss_of
from tests.project import DEFAULTS
from validation.synthetic import THETA, own_law_episode, recorded_yardstick


def noisy():
    """An episode, and five rollouts that move and pull otherwise; some frames are empty."""
    rng = np.random.default_rng(5)
    clouds = [toy.facing(300) if k % 7 else np.zeros((0, 3)) for k in range(50)]
    episode = toy.episode(frames=50, clouds=clouds, force=rng.normal(0, 1, (60, 3)))
    rollouts = toy.rollouts(episode, count=5)
    rollouts.center_line += rng.normal(0, 0.01, rollouts.center_line.shape).astype(np.float32)
    rollouts.force = rng.normal(0, 2, rollouts.force.shape).astype(np.float32)
    return episode, rollouts


def by_numpy(episode, rollouts, loss, window: int = 7) -> dict[str, np.ndarray]:
    """The terms as loss.py's docstring has them."""
    smooth = lambda signal: median_filter(signal, (window, 1), mode="nearest")  # noqa: E731
    force = recorded_force(rollouts, episode, toy.CUTOFF)
    gap = np.stack([smooth(episode.force) - smooth(each) for each in force])
    power = (gap * smooth(episode.velocity)).sum(axis=2)
    return {
        "geom": 100 * np.nanmean(loss.frames(rollouts), axis=1),
        "force": np.linalg.norm(gap, axis=2).mean(axis=1),
        "work": np.abs(np.trapezoid(power, dx=toy.PERIOD, axis=1)),
    }


@pytest.mark.parametrize("options", [{}, {"chamfer": "clouds"}, {"median_window": 1}])
def test_terms_are_those_of_numpy(options: dict) -> None:
    """Whatever holds the rollouts: here a part of a wider Warp array, as the simulator has it."""
    episode, rollouts = noisy()
    loss = loss_of(episode, **options)
    expected = by_numpy(episode, rollouts, loss, options.get("median_window", 7))
    start()
    wide = np.full(np.add(rollouts.force.shape, (0, 5, 1)), np.nan, np.float32)
    wide[:, 5:, :3] = rollouts.force
    there = type(rollouts)(**vars(rollouts))
    there.force = wp.array(wide, device="cpu")[:, 5:, :3]
    there.center_line = wp.array(rollouts.center_line, device="cpu")
    assert min(values.min() for values in expected.values()) > 1e-3
    for name in TERMS:
        np.testing.assert_allclose(loss.terms(rollouts)[name], expected[name], rtol=1e-9)
        np.testing.assert_array_equal(loss.terms(there)[name], loss.terms(rollouts)[name])


def test_another_schedule_brings_its_own_filter() -> None:
    """The filter depends on the times of the steps, and is kept on the device."""
    episode, rollouts = noisy()
    loss, later = loss_of(episode), type(rollouts)(**vars(rollouts))
    later.times = rollouts.times + np.linspace(0, 0.02, len(rollouts.times))
    for batch in (rollouts, later, rollouts):
        expected = by_numpy(episode, batch, loss)["force"]
        np.testing.assert_allclose(loss.terms(batch)["force"], expected, rtol=1e-9)


@pytest.mark.skipif(not gpus(), reason="no CUDA device on this machine")
@pytest.mark.parametrize("chamfer", ["symmetric", "clouds"])
def test_terms_of_a_gpu_are_those_of_the_cpu(chamfer: str) -> None:
    """64 rollouts of the CPU, compared there and on the GPU with clouds of noise; to 1e-4."""
    params = load(DEFAULTS)
    sling, episode = recorded_yardstick(params)
    episode = own_law_episode(sling, episode, Parameters.of(sling.law, THETA), cutoff=35.0)
    space = SearchBox.of(params.parameters)
    unit = np.random.default_rng(6).random((64, space.dimension))
    sizes = {"radius": sling.radius, "rest_edges": sling.edge_lengths}
    weights = dict.fromkeys(TERMS, 1.0)
    loss = EpisodeLoss(episode, weights=weights, cutoff=35.0, chamfer=chamfer, **sizes)
    rollouts = interact(sling, episode, space.parameters(space.to_physical(unit)), workers=4)
    assert rollouts.failure == [None] * 64
    moved = replace(
        rollouts,
        force=wp.array(np.asarray(rollouts.force, np.float32), device="cuda:0"),
        center_line=wp.array(rollouts.center_line, device="cuda:0"),
    )
    expected, terms = loss.terms(rollouts), loss.terms(moved)
    for name in TERMS:
        np.testing.assert_allclose(terms[name], expected[name], rtol=1e-4)

    whole = Evaluator(episode, sling, loss, space, device="cuda:0")(unit)
    some = Evaluator(episode, sling, loss, space, device="cuda:0")(unit[7:10])
    for name in TERMS:  # simulated and compared there: no rollout depends on another
        np.testing.assert_array_equal(whole.terms[name][7:10], some.terms[name])


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


def test_a_simulated_force_is_filtered_as_a_recorded_one() -> None:
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


def test_empty_frames_are_left_out() -> None:
    """The term is the mean over the frames that show the band; an episode of none is refused."""
    episode = toy.episode(frames=4)
    clouds = [*episode.clouds[:2], np.zeros((0, 3)), np.zeros((0, 3))]
    shifted = toy.rollouts(episode, shift=(0, 0, -0.01))
    some = loss_of(toy.episode(frames=4, clouds=clouds)).terms(shifted)
    np.testing.assert_allclose(some["geom"], loss_of(episode).terms(shifted)["geom"])
    with pytest.raises(UserError, match="no camera frame"):
        loss_of(toy.episode(frames=4, clouds=[np.zeros((0, 3))] * 4))


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
