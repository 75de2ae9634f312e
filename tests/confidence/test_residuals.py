"""Signed residuals of a straight band, where every offset is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.confidence.residuals import BINS, Residuals
from pipeline.objective.loss import EpisodeLoss
from tests.objective.own_law import visible
from tests.search import toy

PULL = np.linspace(0, 5, 60)  # N, rising, so that the band is taut at some time
CAMERA = np.array([0.3, 0.4, 1.5])


@pytest.fixture(scope="module")
def episode():
    """Points of the side that faces the camera, without noise, and a force that rises along y."""
    rng = np.random.default_rng(0)
    line = toy.straight(1)[0]
    clouds = [
        visible(line, toy.SLING.edge_lengths, toy.RADIUS, CAMERA, 0.0, rng) for _ in range(20)
    ]
    force = np.outer(PULL, [0, 1, 0])
    return toy.episode(clouds=clouds, camera=CAMERA, force=force)


def made(episode, shift=(0, 0, 0)) -> Residuals:
    return Residuals(episode, toy.SLING, toy.CUTOFF, toy.straight(20) + np.asarray(shift))


def of(residuals: Residuals, vector: np.ndarray, channel: str) -> np.ndarray:
    rows = np.concatenate([one.rows for one in residuals.groups if one.channel == channel])
    return vector[rows]


def test_every_residual_is_in_one_group(episode) -> None:
    residuals = made(episode)
    rows = np.concatenate([group.rows for group in residuals.groups])
    np.testing.assert_array_equal(np.sort(rows), np.arange(residuals.size))
    assert len(residuals.frame) == 20 * BINS
    vector = residuals(toy.rollouts(episode, 3))
    assert vector.shape == (3, residuals.size)
    np.testing.assert_array_equal(vector[0], vector[2])


def test_the_visible_side_of_the_true_band_leaves_no_offset(episode) -> None:
    """Means over the half of the tube that faces the camera: 2/pi of a radius before its axis."""
    residuals = made(episode)
    vector = residuals(toy.rollouts(episode))[0]
    for channel in ("cloud_depth", "cloud_side"):
        assert abs(of(residuals, vector, channel).mean()) < 1e-4


@pytest.mark.parametrize("shift", [(0, 0.004, 0), (0, 0, -0.003), (0, 0.02, 0.01)])
def test_an_offset_of_the_simulation_is_seen_with_its_sign(episode, shift) -> None:
    """In both components across the band; whether the reference lies there as well or not."""
    for reference in ((0, 0, 0), shift):
        residuals = made(episode, reference)
        vector = residuals(toy.rollouts(episode, shift=shift))[0]
        change = vector - residuals(toy.rollouts(episode))[0]
        for channel, direction in (("depth", residuals.depth), ("side", residuals.side)):
            expected = -direction @ np.array(shift)
            found = of(residuals, change, f"cloud_{channel}")
            np.testing.assert_allclose(found, expected, atol=1e-6)
            offset = of(residuals, vector, f"cloud_{channel}")
            assert np.mean(offset - expected) == pytest.approx(0, abs=2e-4)


def test_a_slide_along_the_band_is_not_seen(episode) -> None:
    residuals = made(episode)
    change = np.diff(
        [residuals(toy.rollouts(episode, shift=(step, 0, 0)))[0] for step in (0, 0.002)], axis=0
    )[0]
    inner = np.tile((residuals.bin > 0) & (residuals.bin < BINS - 1), 2)
    assert np.abs(change[-len(inner) :][inner]).max() < 1e-6


def test_residuals_are_smooth(episode) -> None:
    """Second differences of a small step are of second order: no nearest point jumps."""
    residuals = made(episode)
    values = [
        residuals(toy.rollouts(episode, shift=(0, step, 0)))[0] for step in (-1e-3, 0.0, 1e-3)
    ]
    bend = values[0] - 2 * values[1] + values[2]
    assert np.abs(bend).max() < 2e-5
    assert np.abs(values[2] - values[0]).max() > 1e-3


def test_columns_are_what_moved_measurements_change(episode) -> None:
    """Clouds shifted and turned about the camera, forces with a bias, against the columns."""
    residuals = made(episode)
    rollouts, columns = toy.rollouts(episode), residuals.columns()
    still = residuals(rollouts)[0]
    bias = np.array([0.1, -0.2, 0.3])
    turn, shift = np.array([1e-3, -2e-3, 5e-4]), np.array([1e-3, 5e-4, -1e-3])
    rotation = Rotation.from_rotvec(turn)
    again = made(replace(episode, force=episode.force + bias))
    again.point = rotation.apply(residuals.point - CAMERA) + CAMERA + shift
    expected = sum(
        size * columns[f"{name}_{axis}"]
        for name, sizes in (("force_bias", bias), ("cloud_shift", shift), ("cloud_turn", turn))
        for axis, size in zip("xyz", sizes, strict=True)
    )
    change = again(rollouts)[0] - still
    inner = np.concatenate(
        [
            np.ones(residuals.size - 2 * len(residuals.bin), bool),
            np.tile((residuals.bin > 0) & (residuals.bin < BINS - 1), 2),
        ]
    )
    np.testing.assert_allclose(change[inner], expected[inner], atol=2e-5)
    assert np.abs(expected[-len(residuals.bin) :]).max() > 1e-3


def test_forces_pass_the_filter_of_the_loss(episode) -> None:
    weights = {"geom": 1.0, "force": 1.0, "work": 1.0, "taut": 0.0}
    loss = EpisodeLoss(
        episode, radius=toy.RADIUS, rest_length=toy.LENGTH, weights=weights, cutoff=toy.CUTOFF
    )
    rollouts = toy.rollouts(episode, 2)
    rollouts.force[:] = np.sin(3 * rollouts.times)[:, None] * [1.0, 2.0, -1.0]
    residuals, expected = made(episode), loss.filtered(rollouts)
    np.testing.assert_allclose(residuals.force(rollouts), expected, atol=1e-9)
    until = episode.release_time - episode.time
    held = expected[:, (until > 0.05) & (until < 0.5)].mean(axis=1)
    found = residuals.hold_force(residuals(rollouts))
    np.testing.assert_allclose(found, np.linalg.norm(held, axis=1), atol=1e-9)


def test_frames_without_points_are_masked(episode) -> None:
    clouds = [cloud if number % 2 else cloud[:0] for number, cloud in enumerate(episode.clouds)]
    residuals = made(replace(episode, clouds=clouds))
    assert set(residuals.frame.tolist()) == set(range(1, 20, 2))
    half = [cloud[cloud[:, 0] < 0] for cloud in episode.clouds]
    residuals = made(replace(episode, clouds=half))
    assert residuals.bin.max() == BINS // 2 - 1
