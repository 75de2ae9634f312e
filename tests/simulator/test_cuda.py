"""One source for both: on a GPU the simulator does what it does on the CPU."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.base.machine import gpus
from sling2sim2real.simulator import interact, launch
from sling2sim2real.simulator.model import LaunchHistory
from sling2sim2real.simulator.parameters import Parameters
from tests.simulator.bands import neo, random_draws, random_thetas

pytestmark = pytest.mark.skipif(not gpus(), reason="no CUDA device on this machine")


RUBBER = {"mooney_share": 0.3, "relaxation": 0.02, "flow": 0.2, "log_flow_rate": 3.0}
LAWS = {"neo_hookean": {}, "rubber": RUBBER, "corotated": {}}


@pytest.mark.parametrize("law", LAWS)
def test_interaction_agrees_with_the_cpu(strong_grip, episode, law):
    """Held force within 0.1 %; the middle of the taut band within 1 mm in the first recoil."""
    strong_grip = replace(strong_grip, law=law)
    thetas = Parameters.of(law, random_thetas(64, seed=2), **LAWS[law])
    cpu = interact(strong_grip, episode, thetas, workers=2)
    gpu = interact(strong_grip, episode, thetas, device="cuda:0")
    good = np.array(
        [a is None and b is None for a, b in zip(cpu.failure, gpu.failure, strict=True)]
    )
    assert good.sum() >= 62
    held = np.argmin(np.abs(cpu.times - 2.3))
    assert np.allclose(cpu.force[good, held], gpu.force[good, held], rtol=1e-3, atol=5e-3)
    frame = np.searchsorted(cpu.cloud_time, 2.43)
    gap = np.abs(cpu.center_line - gpu.center_line)[good, frame, strong_grip.middle]
    assert np.median(gap) < 1e-4 and np.percentile(gap, 95) < 1e-3


@pytest.mark.parametrize("law", LAWS)
def test_launches_agree_with_the_cpu(sling, law, launch_setup):
    """Landing within 0.1 %, by an arm that gives way."""
    sling = replace(sling, law=law)
    launch_setup = replace(launch_setup, arm_stiffness=12000.0, history=LaunchHistory(4.0, 2.0))
    draws = random_draws(64, np.random.default_rng(4))
    theta = Parameters.of(law, [2.5e5, 0.45, 2e-3, 0.5, 1.0], **LAWS[law])
    cpu, gpu = (
        launch(sling, launch_setup, theta, draws),
        launch(sling, launch_setup, theta, draws, device="cuda:0"),
    )
    assert cpu.failure == gpu.failure
    assert gpu.landing_y == pytest.approx(cpu.landing_y, rel=1e-3)


def test_what_stays_on_the_gpu_is_what_is_fetched(strong_grip, episode):
    """Forces and centre lines of 65 slings, which fill no warp."""
    thetas = random_thetas(65, seed=5)
    stays = interact(strong_grip, episode, neo(thetas), device="cuda:0", fetch=False)
    fetched = interact(strong_grip, episode, neo(thetas), device="cuda:0")
    assert not isinstance(stays.center_line, np.ndarray)
    assert np.array_equal(stays.center_line.numpy(), fetched.center_line)
    assert np.array_equal(stays.force.numpy(), fetched.force)


def test_result_depends_on_no_neighbour_on_the_gpu(strong_grip, episode):
    thetas = random_thetas(20, seed=3)
    together = interact(strong_grip, episode, neo(thetas), device="cuda:0")
    alone = interact(strong_grip, episode, neo(thetas[7]), device="cuda:0")
    assert np.array_equal(together.force[7], alone.force[0])
    assert np.array_equal(together.center_line[7], alone.center_line[0])
