"""Distances between clouds and tubes, against a slow reference and shapes with known answers."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sling2sim2real.identification.objective.chamfer import LANES, SAMPLES, Chamfer
from tests.identification.objective.toy import LENGTH, RADIUS, by_spreads, facing, straight

CAMERA = np.array([1.0, -0.8, 0.6])


def chamfer_of(clouds, camera=CAMERA, **more) -> Chamfer:
    return Chamfer(clouds, camera, radius=RADIUS, rest_length=LENGTH, **more)


def reference(cloud: np.ndarray, line: np.ndarray) -> float:
    """One frame in float64, point by point as the docstring of chamfer.py says it."""
    line = line.astype(float)
    start, edge = line[:-1], np.diff(line, axis=0)
    length = np.linalg.norm(edge, axis=1)
    radius = RADIUS * np.sqrt(LENGTH / len(edge) / length)
    part = np.clip(((cloud[:, None] - start) * edge).sum(2) / length**2, 0, 1)
    distance = np.linalg.norm(cloud[:, None] - start - part[..., None] * edge, axis=2)
    measured = np.abs((distance - radius).min(axis=1)).mean()
    parts = (np.arange(SAMPLES) + 0.5) / SAMPLES
    centre = (start[:, None] + parts[:, None] * edge[:, None]).reshape(-1, 3)
    along = np.repeat(edge / length[:, None], SAMPLES, axis=0)
    view = CAMERA - centre
    view -= (view * along).sum(1, keepdims=True) * along
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    ridge = centre + np.repeat(radius, SAMPLES)[:, None] * view
    return (measured + cKDTree(cloud).query(ridge)[0].mean()) / 2


def test_equals_the_reference() -> None:
    rng = np.random.default_rng(1)
    sizes = [1, 15, 16, 17, 100, 33, 1000]
    lines = straight(len(sizes))[None] + rng.normal(0, 0.02, (3, len(sizes), 25, 3))
    lines = lines.astype(np.float32)
    clouds = [
        (lines[0, k][rng.integers(0, 25, size)] + rng.normal(0, 0.01, (size, 3))).astype(np.float32)
        for k, size in enumerate(sizes)
    ]
    expected = [[reference(c, line[k]) for k, c in enumerate(clouds)] for line in lines]
    np.testing.assert_allclose(chamfer_of(clouds)(lines), expected, rtol=2e-5, atol=1e-7)


@pytest.mark.parametrize("lanes", LANES.values())
def test_what_is_skipped_changes_no_bit(lanes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines near and far, crumpled, of edges far too long, at a point, huge, and broken ones."""
    monkeypatch.setitem(LANES, "cpu", lanes)  # a vector as wide as a warp, too
    lines, clouds = by_spreads(12)
    lines[9], lines[10, :, 7], lines[11, :, 20] = np.nan, np.nan, np.inf
    distances, whole = (chamfer_of(clouds, culled=culled)(lines) for culled in (True, False))
    np.testing.assert_array_equal(distances, whole)
    assert np.isfinite(np.delete(distances[:9], 8, axis=1)).all()


def test_a_stretched_band_is_thinner() -> None:
    """Twice as long at constant volume: points on a surface of radius R / sqrt(2) are at zero."""
    line = 2 * straight(1)
    cloud = facing() * [2, 1, 1 / np.sqrt(2)]
    for height, expected in ((0.0, 0.0), (0.01, 0.01)):
        measured, _ = chamfer_of([cloud + [0, 0, height]]).errors(line[None], "cpu").numpy()
        assert measured == pytest.approx(expected, abs=1e-6)


def test_only_the_side_that_the_camera_sees_counts() -> None:
    """The ridge that faces the camera has measured points; seen from below, it is 2 R away."""
    for side, expected in ((1, 0.0), (-1, 2 * RADIUS)):
        chamfer = chamfer_of([facing()], np.array([0, 0, side * 1e4]))
        assert 2 * chamfer(straight(1)[None])[0, 0] == pytest.approx(expected, abs=1e-4)


def test_an_empty_frame_is_nan_and_changes_no_other() -> None:
    def distances(clouds):
        return chamfer_of(clouds)(np.tile(straight(len(clouds)) + 0.01, (2, 1, 1, 1)))

    empty = np.zeros((0, 3), np.float32)
    frames = distances([empty, facing(), empty, facing(50)])
    assert np.isnan(frames[:, [0, 2]]).all()
    np.testing.assert_array_equal(frames[:, [1, 3]], distances([facing(), facing(50)]))
    assert np.isnan(distances([empty])).all()


def test_a_wrong_number_of_frames_is_refused() -> None:
    chamfer = chamfer_of([facing()])
    with pytest.raises(ValueError, match="2 simulated frames, 1 measured"):
        chamfer(straight(2)[None])
