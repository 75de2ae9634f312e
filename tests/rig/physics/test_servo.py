"""The arm that gives way: a damped oscillator, whose answers are closed forms."""

import numpy as np
import pytest

from pipeline.params import Params
from rig.physics.motion import HandMotion
from rig.physics.servo import Servo

MASS, STIFFNESS, DAMPING = 5.0, 12000.0, 200.0


@pytest.fixture
def motion() -> HandMotion:
    rng = np.random.default_rng(0)
    return HandMotion.through(np.array([0.0, 0.0, -0.2]), 0.0, (0.004, 1.0), rng)


def test_it_swings_back_like_an_oscillator(motion: HandMotion) -> None:
    """Let go 1 mm off its path, at rest: the textbook's damped cosine."""
    follow = Servo(MASS, STIFFNESS, DAMPING, motion.path)
    start, offset = 9.4, np.array([1e-3, 2e-3, -1e-3])
    times = np.linspace(start, motion.end, 50)
    place = motion.position(start)
    states = follow.alone(np.concatenate([place + offset, np.zeros(3)]), times, 1e-9)
    decay = DAMPING / (2 * MASS)
    rate = np.sqrt(STIFFNESS / MASS - decay**2)
    t = (times - start)[:, None]
    shape = np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
    np.testing.assert_allclose(states[:, :3] - place, shape * offset, atol=1e-8)


def test_a_steady_load_pushes_it_aside_by_its_stiffness(motion: HandMotion) -> None:
    follow = Servo(MASS, STIFFNESS, DAMPING, motion.path)
    load, times = np.array([[0.0, 12.0, -1.0]]), np.array([7.0])
    aside = np.hstack([motion.position(times) + load / STIFFNESS, np.zeros((1, 3))])
    np.testing.assert_allclose(follow.acceleration(times, aside, load), 0, atol=1e-9)


def test_damping_ratio(params: Params, motion: HandMotion) -> None:
    critical = params.rig.arm.model_copy(update={"damping_ratio": 1.0})
    servo = Servo.of(critical, motion.path)
    assert np.isclose(servo.damping**2, 4 * servo.mass * servo.stiffness)
