"""The rig's camera: what an exposure smears, and what a window leaves out."""

import numpy as np
import pytest

from pipeline.params import Params
from rig.physics.scene import tube
from rig.recorder.camera import (
    Exposure,
    VirtualCamera,
    blurred,
    measured_depth,
    nearer,
)
from rig.recorder.record import INSTANTS, MOST_INSTANTS, instants_of

LINE = np.stack([np.linspace(-0.1, 0.1, 30), np.zeros(30), np.zeros(30)], axis=1)
RADIUS = np.full(30, 0.005)


@pytest.fixture
def camera() -> VirtualCamera:
    return VirtualCamera.looking(np.array([0.0, 0.8, 0.3]), np.zeros(3), 495.0)


def wall(camera: VirtualCamera, distance: float) -> Exposure:
    depth = np.full(camera.size[::-1], distance, np.float32)
    return Exposure(np.zeros((*depth.shape, 3), np.float32), depth, depth, depth)


def test_a_window_sees_what_all_rays_see(camera: VirtualCamera) -> None:
    """Every ray that hits lies in it."""
    mesh = tube(LINE, RADIUS, (1.0, 0.0, 0.0))
    rows, columns = camera.window(mesh.vertices)
    seen = np.isfinite(camera.see(mesh).depth)
    assert 0 < seen.sum() < seen.size / 10
    camera.__dict__["window"] = lambda points: (slice(None), slice(None))
    everywhere = np.isfinite(camera.see(mesh).depth)
    np.testing.assert_array_equal(seen, everywhere)
    assert not everywhere[: rows.start].any() and not everywhere[:, columns.stop :].any()


def test_a_fast_band_is_smeared_and_loses_depth(camera: VirtualCamera, params: Params) -> None:
    """32 mm of way in one exposure, of a band 10 mm thick: no pixel shows it longer than not."""
    ways = np.linspace(-0.016, 0.016, 9)
    seen = [
        nearer(wall(camera, 2.0), camera.see(tube(LINE + [0, 0, way], RADIUS, (1.0, 0, 0))))
        for way in ways
    ]
    fast, still = blurred(seen), seen[4]
    sharp, wide = (np.count_nonzero(view.color[..., 0] > 0) for view in (still, fast))
    assert 3 < wide / sharp < 5
    assert np.isclose(fast.color.sum(), np.mean([view.color.sum() for view in seen]), rtol=1e-5)
    assert (fast.depth < 1.9).sum() < 0.1 * (still.depth < 1.9).sum()
    rng = np.random.default_rng(0)
    depth = measured_depth(fast, params.rig.camera, rng)
    smeared = fast.nearest < 1.9
    assert 0.4 < np.mean(depth[smeared] == 0) < 0.65
    flying = (depth[smeared] > 900) & (depth[smeared] < 1900)
    assert 0.05 < flying.mean() < 0.25


def test_an_exposure_has_as_many_instants_as_the_band_moves(camera: VirtualCamera) -> None:
    still = np.repeat(LINE[None], INSTANTS, axis=0)
    assert instants_of(still, camera).shape == (1, 30, 3)
    moving = still + np.linspace(0, 0.03, INSTANTS)[:, None, None] * [0, 0, 1]
    many = instants_of(moving, camera)
    assert 5 <= len(many) <= MOST_INSTANTS
    np.testing.assert_allclose(many.mean(axis=0), moving.mean(axis=0), atol=1e-9)
