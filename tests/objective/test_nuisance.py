"""What instruments add is found again in episodes of the simulator's own law, where it is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.episode.episode import Episode
from pipeline.objective.evaluate import Evaluator
from pipeline.objective.loss import EpisodeLoss
from pipeline.objective.nuisance import Delay, DelayedFrames
from pipeline.objective.space import Space
from tests.objective.flaws import flawed_episode
from tests.objective.pulls import PARAMS, pulled, sling_of
from tests.search import toy

SLING = sling_of(0.023)
CUTOFF = 35.65
TRUTH = np.array([3e5, 0.45, 4e-3, 1.0, 1.0])
BOUNDS = {
    "camera_delay": (-0.003, 0.003),
    "force_delay": (-0.003, 0.003),
    "force_gain": (0.95, 1.05),
    **{f"force_bias_{axis}": (-0.5, 0.5) for axis in "xyz"},
    **{f"cloud_shift_{axis}": (-0.01, 0.01) for axis in "xyz"},
}
SHORT = BOUNDS | {"camera_delay": (-0.001, 0.001), "force_delay": (-0.001, 0.001)}
INJECTED = {  # and how near it must be found with theta known
    "camera_delay": (0.0014, 1e-4),
    "force_delay": (-0.0016, 2e-4),
    "force_gain": (1.02, 5e-4),
    "force_bias_x": (0.2, 5e-3),
    "force_bias_y": (-0.1, 5e-3),
    "force_bias_z": (0.15, 5e-3),
    "cloud_shift_x": (0.004, 3e-4),
    "cloud_shift_y": (-0.003, 3e-4),
    "cloud_shift_z": (0.0025, 3e-4),
}


def recorded(flaws: dict[str, float]) -> Episode:
    """What instruments with these flaws record of the band that TRUTH is of."""
    clean = pulled(133, 118, 0.5, (0.7, 2.6), (0.7, 2.6), 3.1, first_frame=0.004)
    return flawed_episode(SLING, clean, TRUTH, flaws, cutoff=CUTOFF)


def loss_of(episode: Episode, sling, taut: float = 0.0, **more) -> EpisodeLoss:
    sizes = {"radius": sling.radius, "rest_length": sling.edge_lengths}
    weights = {"geom": 1.0, "force": 1.0, "work": 0.0, "taut": taut}
    return EpisodeLoss(episode, **sizes, weights=weights, cutoff=CUTOFF, **more)


def evaluator(episode: Episode, nuisances: dict) -> Evaluator:
    loss = loss_of(episode, SLING, taut=1.0, nuisances=nuisances)
    space = Space.of(PARAMS.parameters, nuisances)
    return Evaluator(episode, SLING, loss, space)


def test_each_is_found_again() -> None:
    """With theta and the others known, the loss is least where it was injected, and clearly so."""
    evaluate = evaluator(recorded({name: value for name, (value, _) in INJECTED.items()}), BOUNDS)
    space = evaluate.space
    known = np.append(TRUTH, [INJECTED[name][0] for name in space.nuisances])

    def losses(name: str, grid) -> np.ndarray:
        points = np.tile(known, (len(grid), 1))
        points[:, space.names.index(name)] = grid
        return evaluate(space.to_unit(points)).total

    for name, (value, near) in INJECTED.items():
        coarse = np.linspace(*BOUNDS[name], 16)
        best = coarse[np.argmin(losses(name, coarse))]
        fine = best + (coarse[1] - coarse[0]) * np.linspace(-1, 1, 32)
        total = losses(name, fine)
        assert fine[np.argmin(total)] == pytest.approx(value, abs=near), name
        assert total.min() < 0.95 * losses(name, [1.0 if name == "force_gain" else 0.0])[0], name


def test_neutral_values_change_nothing() -> None:
    episode = recorded({})
    evaluate, without = evaluator(episode, SHORT), evaluator(episode, {})
    neutral = [1.0 if name == "force_gain" else 0.0 for name in evaluate.space.nuisances]
    unit = np.random.default_rng(2).random((4, 5))
    points = np.column_stack([without.space.to_physical(unit), np.tile(neutral, (4, 1))])
    found, plain = evaluate(evaluate.space.to_unit(points)), without(unit)
    assert found.failure == plain.failure
    np.testing.assert_allclose(found.total, plain.total, rtol=1e-5)


@given(st.floats(-0.02, 0), st.floats(1e-4, 0.02), st.floats(0, 1))
def test_a_delay_lies_between_those_that_are_simulated(low, high, share) -> None:
    """At most a millisecond apart; beyond the bounds the nearest counts."""
    values = Delay((low, high)).values
    assert (values[0], values[-1]) == (low, high)
    assert np.diff(values).max() <= 1e-3 + 1e-12
    asked = np.array([low + share * (high - low), low - 1, high + 1])
    below, part = Delay((low, high)).between(asked)
    found = values[below] + part * (values[below + 1] - values[below])
    np.testing.assert_allclose(found, np.clip(asked, low, high), atol=1e-12)


def test_a_picture_of_a_steady_motion_is_that_of_before() -> None:
    """A band that moves at 1 m/s along y: stamps less the delay are its y, whatever the stamps."""
    stamps = np.array([0.1, 0.104, 0.3, 0.2])  # nearer than the bounds, and out of order
    delayed = DelayedFrames(stamps, (-0.004, 0.003))
    assert np.all(np.diff(delayed.stamps) > 0)
    lines = np.zeros((3, len(delayed.stamps), 2, 3))
    lines[..., 1] = delayed.stamps[:, None]
    delay = np.array([0.0024, 0.0, -0.0033])
    expected = stamps - delay[:, None]
    np.testing.assert_allclose(delayed(lines, delay)[:, :, 1, 1], expected, atol=1e-12)


def test_what_a_sensor_makes_of_a_ramp() -> None:
    """2 N/s, felt late, more and with a bias: gain · 2 (t - delay) + bias, away from the ends."""
    episode = toy.episode(samples=100)
    lines = toy.rollouts(episode, count=2)
    lines.force[..., 1] = 2 * lines.times
    loss = loss_of(episode, toy.SLING, nuisances={"force_delay": (-0.005, 0.005)})
    delay, gain, bias = np.array([0.0033, -0.005]), np.array([1.5, 0.8]), np.array([0.3, -0.2])
    values = {"force_delay": delay, "force_gain": gain, "force_bias_y": bias}
    inside = slice(10, -10)
    found = loss.filtered(lines, values)[:, inside]
    expected = gain[:, None] * 2 * (episode.time - delay[:, None]) + bias[:, None]
    np.testing.assert_allclose(found[..., 1], expected[:, inside], atol=1e-4)
    np.testing.assert_allclose(found[..., [0, 2]], 0, atol=1e-9)


def test_a_shift_is_that_of_the_clouds() -> None:
    """Clouds 1 cm too far up: with that shift nothing is left, with the opposite 2 cm are."""
    episode = toy.episode(clouds=[toy.facing() + [0, 0, 0.01] for _ in range(20)])
    loss = loss_of(episode, toy.SLING)
    shift = {"cloud_shift_z": np.array([0.01, 0.0, -0.01])}
    found = loss.terms(toy.rollouts(episode, count=3), shift)["geom"]
    np.testing.assert_allclose(found, [0, 1, 2], atol=0.02)


def test_arrays_of_a_gpu_are_taken_as_well() -> None:
    """Rollouts whose long arrays are Warp's give the same terms to the bit."""
    import warp as wp

    episode = recorded({})
    evaluate = evaluator(episode, SHORT)
    space = evaluate.space
    points = space.to_physical(np.random.default_rng(3).random((2, space.dimension)))
    rollouts, values = evaluate.rollouts(points)
    arrays = {
        name: wp.array(np.ascontiguousarray(getattr(rollouts, name)), device="cpu")
        for name in ("force", "center_line")
    }
    on_device = SimpleNamespace(times=rollouts.times, **arrays)
    assert set(values) == set(BOUNDS)
    found, expected = (evaluate.loss.terms(one, values) for one in (on_device, rollouts))
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value)
