"""The printed Chamfer distance, against other libraries and shapes with known answers."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from scipy.spatial.distance import cdist

from pipeline.objective.chamfer import Chamfer
from pipeline.objective.clouds import AROUND, RINGS, CloudDistance
from pipeline.objective.loss import TERMS, EpisodeLoss
from tests.search.toy import CUTOFF, LENGTH, RADIUS, episode, facing, rollouts, straight

CAMERA = np.array([0.0, 0.0, 1e4])
TUBE = {"radius": RADIUS, "rest_length": LENGTH}


def test_equals_all_pairs_of_scipy_and_open3d() -> None:
    open3d = pytest.importorskip("open3d")
    rng = np.random.default_rng(3)
    sizes = [1, 2, 300, 1000]
    lines = straight(len(sizes))[None] + rng.normal(0, 0.02, (2, len(sizes), 25, 3))
    clouds = [rng.normal(0, 0.1, (size, 3)).astype(np.float32) for size in sizes]
    chamfer = CloudDistance(clouds, CAMERA, **TUBE)
    found = chamfer(lines.astype(np.float32))
    for line, row in zip(lines.astype(np.float32), found, strict=True):
        for k, cloud in enumerate(clouds):
            vertices = chamfer.vertices(line[k])
            pairs = cdist(cloud, vertices)
            assert row[k] == pytest.approx((pairs.min(0).mean() + pairs.min(1).mean()) / 2)
            one, other = (
                open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.astype(float)))
                for points in (cloud, vertices)
            )
            both = one.compute_point_cloud_distance(other), other.compute_point_cloud_distance(one)
            assert row[k] == pytest.approx((np.mean(both[0]) + np.mean(both[1])) / 2)


def test_the_side_that_no_camera_sees_counts() -> None:
    """A cloud on the ridge: a vertex at the angle a is 2 R sin(a / 2) away."""
    found = CloudDistance([facing(20_000)], CAMERA, **TUBE)(straight(1)[None])[0, 0]
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    back, there = (2 * RADIUS * np.abs(np.sin(angle / 2))).mean(), LENGTH / RINGS / 4
    assert found == pytest.approx((back + there) / 2, rel=0.01)
    seen = Chamfer([facing(20_000)], CAMERA, **TUBE)(straight(1)[None])[0, 0]
    assert seen < 0.1 * found


def test_vertices_lie_on_the_tube_and_are_even_along_the_unstretched_band() -> None:
    sizes = np.geomspace(1, 8, 12)
    rest = LENGTH * np.concatenate([sizes, sizes[::-1]]) / sizes.sum() / 2
    for stretch in (1.0, 2.0):
        line = np.zeros((25, 3))
        line[1:, 0] = stretch * np.cumsum(rest)
        chamfer = CloudDistance([facing()], CAMERA, radius=RADIUS, rest_length=rest)
        vertices = chamfer.vertices(line)
        assert vertices.shape == (RINGS * AROUND, 3)
        across = np.hypot(vertices[:, 1], vertices[:, 2])
        np.testing.assert_allclose(across, RADIUS / np.sqrt(stretch), rtol=1e-9)
        along = vertices[:, 0].reshape(RINGS, AROUND)
        np.testing.assert_allclose(np.ptp(along, axis=1), 0, atol=1e-9)
        np.testing.assert_allclose(np.diff(along[:, 0]), stretch * LENGTH / RINGS, rtol=1e-6)


def test_empty_clouds_and_broken_rollouts_are_no_number_and_the_others_stay() -> None:
    lines = np.tile(straight(3), (3, 1, 1, 1))
    lines[1, 2, 7] = np.nan
    found = CloudDistance([facing(), np.zeros((0, 3)), facing()], CAMERA, **TUBE)(lines)
    assert np.isnan(found[:, 1]).all() and np.isnan(found[1, 2])
    np.testing.assert_array_equal(found[0, [0, 2]], found[2, [0, 2]])
    assert found[1, 0] == found[0, 0] == found[0, 2]


def test_a_loss_takes_it_wherever_the_rollouts_are() -> None:
    """Geometry alone changes; a copy of the rollouts as on a device costs the same."""
    recorded = episode()
    seen, clouds = (
        EpisodeLoss(
            recorded, weights=dict.fromkeys(TERMS, 1.0), cutoff=CUTOFF, chamfer=kind, **TUBE
        )
        for kind in ("symmetric", "clouds")
    )
    simulated = rollouts(recorded, count=2, shift=(0, 0.003, 0), force=(0, 1, 0))
    there = type(simulated)(**vars(simulated))
    there.force = wp.array(simulated.force.astype(np.float32), device="cpu")
    there.center_line = wp.array(simulated.center_line, device="cpu")
    expected, found = seen.terms(simulated), clouds.terms(simulated)
    for name in ("force", "work"):
        np.testing.assert_array_equal(found[name], expected[name])
    assert (found["geom"] > 1.2 * expected["geom"]).all()
    for name, values in clouds.terms(there).items():
        np.testing.assert_allclose(values, found[name], rtol=1e-6)


def test_a_perfect_place_costs_least() -> None:
    recorded = episode(frames=3)
    loss = EpisodeLoss(
        replace(recorded, clouds=[facing(500)] * 3),
        weights=dict.fromkeys(TERMS, 1.0),
        cutoff=CUTOFF,
        chamfer="clouds",
        **TUBE,
    )
    shifts = (-0.01, -0.003, 0.0, 0.003, 0.01)
    geom = [loss.terms(rollouts(recorded, shift=(0, s, 0)))["geom"][0] for s in shifts]
    assert np.argmin(geom) == 2
