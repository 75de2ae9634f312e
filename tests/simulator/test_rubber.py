"""The law `rubber`: what it adds, what it refuses, and that its memory turns with the band."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sling2sim2real.simulator import interact, launch
from sling2sim2real.simulator.launch import memory_of_pull
from sling2sim2real.simulator.model import LaunchHistory
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import BRANCH_TIMES_S, RUBBER, flowed
from tests.simulator.bands import neo

THETA = np.array([3e5, 0.45, 2e-3, 0.5, 0.7])
DRAW = np.array([-0.35, -0.15])


def gum(**others: float | np.ndarray) -> Parameters:
    """THETA, and what the law has of its own."""
    return Parameters.of(RUBBER, THETA, **others)


def unrelaxed(band, history: LaunchHistory, draws: np.ndarray) -> np.ndarray:
    """What the branches that relax carry after a pull, shape (N, 8)."""
    return memory_of_pull(band, history, gum(), draws)["unrelaxed"]


@pytest.fixture(scope="module")
def rubber(sling):
    return replace(sling, law=RUBBER)


def test_without_its_parameters_it_is_the_neo_hookean_law_to_the_bit(
    sling, rubber, episode, launch_setup
):
    for plain, other in zip(
        (interact(sling, episode, neo(THETA)), launch(sling, launch_setup, neo(THETA), DRAW)),
        (interact(rubber, episode, gum()), launch(rubber, launch_setup, gum(), DRAW)),
        strict=True,
    ):
        same = "force", "center_line", "landing_y", "hold_force"
        for name in (name for name in same if hasattr(plain, name)):
            np.testing.assert_array_equal(getattr(plain, name), getattr(other, name))


def test_each_launch_of_a_batch_has_what_its_band_had_seen(rubber, launch_setup):
    def launched(deepest, softening: float = 0.4):
        setup = replace(launch_setup, history=LaunchHistory(2.0, 1.0, deepest))
        return launch(rubber, setup, gum(softening=softening), [DRAW] * np.size(deepest)).landing_y

    seen = np.array([0.30, 0.30, 0.42, 0.55])
    together = launched(seen)
    np.testing.assert_array_equal(together, [launched(float(depth))[0] for depth in seen])
    assert together[0] > 1.01 * together[2] > 1.01 * together[3]
    np.testing.assert_array_equal(launched(seen, 0.0), launched(0.30, 0.0)[0])


def test_every_theta_may_have_its_own_parameters(rubber, launch_setup):
    parameters = {
        "mooney_share": np.array([0.0, 0.5, -0.2]),
        "upturn": np.array([0.0, 0.1, 0.2]),
        "softening": np.array([0.3, 0.0, 0.1]),
        "relaxation": np.array([0.0, 0.01, 0.03]),
        "flow": np.array([0.2, 0.0, 0.1]),
        "log_flow_rate": np.array([2.0, 0.0, 3.0]),
    }
    many, setup = gum(**parameters), replace(launch_setup, history=LaunchHistory(2.0, 1.0))
    together = launch(rubber, setup, many, DRAW).landing_y
    alone = [launch(rubber, setup, many[k : k + 1], DRAW).landing_y[0] for k in range(3)]
    np.testing.assert_array_equal(together, alone)


def test_memory_of_a_pull_is_that_of_short_steps_and_fades(rubber):
    drawn = np.array([[-0.40, 0.0]])
    carried = unrelaxed(rubber, LaunchHistory(4.0, 2.0), drawn)[0]
    step = 1e-3  # Euler's method on o' = p' - o/t
    part = np.clip(np.arange(0, 6, step) / 4, 0, 1)
    depth = 0.4 * part**2 * (3 - 2 * part)
    stretch = np.maximum(2 * np.hypot(rubber.half_width, depth) / rubber.rest_length, 1)
    stress = stretch - stretch**-2
    summary = np.zeros(len(BRANCH_TIMES_S))
    for change in np.diff(stress):
        summary += change - step * summary / BRANCH_TIMES_S
    np.testing.assert_allclose(carried, summary / stress[-1], atol=2e-3)
    assert np.all(np.diff(carried) >= -1e-12)  # slow branches keep more
    assert unrelaxed(rubber, LaunchHistory(4.0, 1e6), drawn).max() < 1e-6
    slack = np.array([[-0.01, 0.0]])
    assert unrelaxed(rubber, LaunchHistory(4.0, 0.0), slack).max() == 0


@pytest.mark.parametrize(("share", "rate"), [(0.0, 2.0), (0.5, 3.5)])
def test_flow_of_a_pull_is_that_of_an_integration(rubber, share, rate):
    """By another library: o' = p' - r |o/E|^3 o over the pull and the pause."""
    drawn, pull_time, pause = np.array([[-0.40, 0.0]]), 4.0, 2.0
    parameters = gum(mooney_share=share, flow=0.2, log_flow_rate=rate)
    history = LaunchHistory(pull_time, pause)
    carried = memory_of_pull(rubber, history, parameters, drawn)["unflowed"][0]

    def stress(time: float) -> float:
        part = min(time / pull_time, 1)
        depth = 0.4 * part**2 * (3 - 2 * part)
        stretch = max(2 * np.hypot(rubber.half_width, depth) / rubber.rest_length, 1)
        return (stretch - stretch**-2) * (1 - share + share / stretch)

    def change(time: float, o: np.ndarray) -> np.ndarray:
        rise = (stress(time + 1e-6) - stress(time - 1e-6)) / 2e-6
        return rise - 10**rate * np.abs(o / 3) ** 3 * o

    done = solve_ivp(change, (0, pull_time + pause), [0.0], "LSODA", rtol=1e-8, max_step=0.02)
    assert carried == pytest.approx(done.y[0, -1] / stress(pull_time), rel=5e-3)
    assert not memory_of_pull(rubber, None, parameters, drawn)["unflowed"].any()


def test_flowing_on_is_flowing_longer():
    """Exact, whatever the parts are; and implicit Euler's step comes to it as steps are short."""
    o, rate = np.array([0.5, -2.0, 0.0]), 300.0
    np.testing.assert_allclose(flowed(flowed(o, 0.3, rate), 0.7, rate), flowed(o, 1.0, rate))
    for count, allowed in ((100, 0.1), (10_000, 1e-3)):
        left = o
        for _ in range(count):
            left = left / (1 + rate / count * np.abs(left / 3) ** 3)
        np.testing.assert_allclose(left, flowed(o, 1.0, rate), rtol=allowed)
