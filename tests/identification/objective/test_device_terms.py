"""Terms where the rollouts are, against those that NumPy makes of the same rollouts.

Warp's arrays on the CPU stand for a GPU's: the text is one, threads that share a rollout apart.
"""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.base.machine import gpus
from sling2sim2real.base.native import start, wp
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.chamfer import AROUND, LANES, RINGS
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.kernel import clouds_kernel, terms_kernel
from sling2sim2real.identification.objective.loss import TERMS, EpisodeLoss
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.parameters import Parameters
from tests.identification.objective import toy
from tests.identification.objective.toy import loss_of
from tests.project import DEFAULTS
from validation.synthetic import THETA, own_law_episode, recorded_yardstick

CROSSING = [-0.4, -0.3, -0.1, 0.02, *46 * [0.1]]  # y of the frames from the release on


def recoiling():
    """An episode with a recoil, and what moves and pulls otherwise in each of five rollouts."""
    clouds = [toy.facing(300) + [0, y, 0] for y in CROSSING]
    time = 1.0 + 0.01 * np.arange(len(clouds))
    rng = np.random.default_rng(5)
    some = {"clouds": clouds, "cloud_time": time, "release_time": 1.0}
    episode = toy.episode(force=rng.normal(0, 1, (60, 3)), **some)
    rollouts = toy.rollouts(episode, count=5)
    rollouts.center_line += rng.normal(0, 0.01, rollouts.center_line.shape).astype(np.float32)
    rollouts.force = rng.normal(0, 2, rollouts.force.shape).astype(np.float32)
    return episode, rollouts


def there(rollouts):
    """The same rollouts as Warp arrays, the force within a wider one as the simulator gives it."""
    start()
    wide = np.full(np.add(rollouts.force.shape, (0, 5, 1)), np.nan, np.float32)
    wide[:, 5:, :3] = rollouts.force
    moved = type(rollouts)(**vars(rollouts))
    moved.force = wp.array(wide, device="cpu")[:, 5:, :3]
    moved.center_line = wp.array(rollouts.center_line, device="cpu")
    return moved


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"chamfer": "clouds"},
        {"median_window": 1},
        {"median_window": 5},
    ],
    ids=("plain", "clouds", "no median", "narrow median"),
)
def test_terms_are_those_of_numpy(options: dict) -> None:
    episode, rollouts = recoiling()
    loss = loss_of(episode, **options)
    expected, terms = loss.terms(rollouts), loss.terms(there(rollouts))
    assert min(values.min() for values in expected.values()) > 1e-3
    for name in TERMS:
        np.testing.assert_allclose(terms[name], expected[name], rtol=1e-9)


def test_empty_frames_are_left_out() -> None:
    episode, rollouts = recoiling()
    clouds = [*episode.clouds[:1], *4 * [np.zeros((0, 3))], *episode.clouds[5:]]
    loss = loss_of(replace(episode, clouds=clouds))
    expected, terms = loss.terms(rollouts), loss.terms(there(rollouts))
    assert np.isfinite(expected["geom"]).all()
    np.testing.assert_allclose(terms["geom"], expected["geom"], rtol=1e-9)


def test_a_broken_rollout_breaks_no_other() -> None:
    episode, rollouts = recoiling()
    loss = loss_of(episode)
    whole = loss.terms(there(rollouts))
    rollouts.force[2], rollouts.center_line[2] = np.nan, np.nan
    broken = loss.terms(there(rollouts))
    assert np.isnan(broken["force"][2]) and np.isnan(broken["work"][2])
    for name in TERMS:
        np.testing.assert_array_equal(np.delete(broken[name], 2), np.delete(whole[name], 2))


def test_another_schedule_brings_its_own_filter() -> None:
    """The filter depends on the times of the steps, and is kept on the device."""
    episode, rollouts = recoiling()
    loss, later = loss_of(episode), type(rollouts)(**vars(rollouts))
    later.times = rollouts.times + np.linspace(0, 0.02, len(rollouts.times))
    for batch in (rollouts, later, rollouts):
        for name, values in loss.terms(there(batch)).items():
            np.testing.assert_allclose(values, loss.terms(batch)[name], rtol=1e-9)


@pytest.mark.parametrize(
    "kernel_of",
    [partial(terms_kernel, 7), partial(clouds_kernel, 24, RINGS, AROUND, LANES["cuda"])],
    ids=("terms", "clouds"),
)
def test_the_text_compiles_for_a_gpu(tmp_path, kernel_of) -> None:
    """For Hopper, by the compiler that comes with Warp: no GPU is asked for."""
    kernel, _ = kernel_of()
    wp.compile_aot_module(kernel.module, arch=90, module_dir=tmp_path, use_ptx=True)
    (file,) = tmp_path.glob("*.ptx")
    text = file.read_text()
    assert ".target sm_90" in text and "shfl.sync" in text  # threads share a rollout, or a frame


@pytest.mark.skipif(not gpus(), reason="no CUDA device on this machine")
@pytest.mark.parametrize("chamfer", ["symmetric", "clouds"])
def test_terms_of_a_gpu_are_those_of_the_cpu(chamfer: str) -> None:
    """64 rollouts of the CPU, compared there and on the GPU with clouds of noise; to 1e-4."""
    params = load(DEFAULTS)
    sling, episode = recorded_yardstick(params)
    episode = own_law_episode(sling, episode, Parameters.of(sling.law, THETA), cutoff=35.0)
    space = SearchBox.of(params.parameters)
    unit = np.random.default_rng(6).random((64, space.dimension))
    sizes = {"radius": sling.radius, "rest_length": sling.edge_lengths}
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

    whole = Evaluator(episode, sling, loss, space, devices=("cuda:0",))(unit)
    some = Evaluator(episode, sling, loss, space, devices=("cuda:0",))(unit[7:10])
    for name in TERMS:  # simulated and compared there: no rollout depends on another
        np.testing.assert_array_equal(whole.terms[name][7:10], some.terms[name])
