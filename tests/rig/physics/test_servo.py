"""The arm that gives way: a damped oscillator, whose answers are closed forms."""

import numpy as np
import pytest

from pipeline.params import Params
from rig.physics.motion import END, HandMotion
from rig.recorder.servo import Servo

MASS, STIFFNESS, DAMPING = 5.0, 12000.0, 200.0


@pytest.fixture
def motion() -> HandMotion:
    rng = np.random.default_rng(0)
    return HandMotion.through(np.array([0.0, 0.0, -0.2]), 0.0, (0.004, 1.0), rng)


def test_it_swings_back_like_an_oscillator(motion: HandMotion) -> None:
    """Let go 1 mm off its path, at rest: the textbook's damped cosine."""
    follow = Servo(MASS, STIFFNESS, DAMPING, motion)
    start, offset = 9.4, np.array([1e-3, 2e-3, -1e-3])
    times = np.linspace(start, END, 50)
    place = motion.position(start)
    found = follow.alone(np.concatenate([place + offset, np.zeros(3)]), times, 1e-9)
    decay = DAMPING / (2 * MASS)
    rate = np.sqrt(STIFFNESS / MASS - decay**2)
    t = (times - start)[:, None]
    shape = np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
    np.testing.assert_allclose(found[:, :3] - place, shape * offset, atol=1e-8)


def test_without_a_load_it_stays_on_a_path_that_moves(motion: HandMotion) -> None:
    follow, times = Servo(MASS, STIFFNESS, DAMPING, motion), np.linspace(2.5, 5.5, 40)
    start = np.concatenate([motion.position(2.5), motion.position(2.5, 1)])
    found = follow.alone(start, times, 1e-9)
    np.testing.assert_allclose(found[:, :3], motion.position(times), atol=1e-7)
    np.testing.assert_allclose(found[:, 3:], motion.position(times, 1), atol=1e-6)


def test_a_steady_load_pushes_it_aside_by_its_stiffness(motion: HandMotion) -> None:
    follow = Servo(MASS, STIFFNESS, DAMPING, motion)
    load = np.array([0.0, 12.0, -1.0])
    aside = motion.position(7.0) + load / STIFFNESS
    np.testing.assert_allclose(follow(7.0, aside, np.zeros(3), load), 0, atol=1e-9)


def test_columns_are_states(motion: HandMotion) -> None:
    """Many states at one time, and one state at many times, are each alone."""
    follow, rng = Servo(MASS, STIFFNESS, DAMPING, motion), np.random.default_rng(1)
    x, v, load = rng.normal(size=(3, 3, 7))
    together = follow(3.3, x, v, load)
    times = np.linspace(1, 9, 7)
    over_time = follow(times, x, v, load)
    for i in range(7):
        alone = x[:, i], v[:, i], load[:, i]
        np.testing.assert_allclose(together[:, i], follow(3.3, *alone))
        np.testing.assert_allclose(over_time[:, i], follow(times[i], *alone))


def test_damping_ratio(params: Params, motion: HandMotion) -> None:
    critical = params.rig.arm.model_copy(update={"damping_ratio": 1.0})
    servo = Servo.of(critical, motion)
    assert np.isclose(servo.damping**2, 4 * servo.mass * servo.stiffness)
