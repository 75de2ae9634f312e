"""Distances between clouds and bands, against slow references and shapes with known answers."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from sling2sim2real.base.native import wp
from sling2sim2real.identification.objective.chamfer import LANES, Chamfer
from sling2sim2real.identification.objective.kernels import (
    RING_VERTICES,
    RINGS,
    SAMPLES,
    chamfer_kernel,
)
from tests.identification.objective.toy import (
    LENGTH,
    RADIUS,
    SLING,
    by_spreads,
    facing,
    straight,
)

ASIDE, FAR_UP = np.array([1.0, -0.8, 0.6]), np.array([0.0, 0.0, 1e4])
SIZES = np.geomspace(1, 8, 12)  # the middle's edges are the longest
GRADED = LENGTH * np.concatenate([SIZES, SIZES[::-1]]) / SIZES.sum() / 2
SURFACES = pytest.mark.parametrize("surface", ["tube", "mesh"])


def chamfer_of(clouds, camera=ASIDE, surface="tube", rest=SLING.edge_lengths, **more) -> Chamfer:
    return Chamfer(clouds, camera, radius=RADIUS, rest_edges=rest, surface=surface, **more)


def by_tube(cloud: np.ndarray, line: np.ndarray, rest: np.ndarray) -> float:
    """One frame in float64, point by point as the docstring of chamfer.py says it."""
    line = line.astype(float)
    start, edge = line[:-1], np.diff(line, axis=0)
    length = np.linalg.norm(edge, axis=1)
    radius = RADIUS * np.sqrt(rest / np.maximum(length, rest / 4))
    part = np.clip(((cloud[:, None] - start) * edge).sum(2) / length**2, 0, 1)
    distance = np.linalg.norm(cloud[:, None] - start - part[..., None] * edge, axis=2)
    measured = np.abs((distance - radius).min(axis=1)).mean()
    parts = (np.arange(SAMPLES) + 0.5) / SAMPLES
    centre = (start[:, None] + parts[:, None] * edge[:, None]).reshape(-1, 3)
    along = np.repeat(edge / length[:, None], SAMPLES, axis=0)
    view = ASIDE - centre
    view -= (view * along).sum(1, keepdims=True) * along
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    ridge = centre + np.repeat(radius, SAMPLES)[:, None] * view
    nearest = cdist(ridge, cloud).min(axis=1)
    return (measured + np.average(nearest, weights=np.repeat(rest, SAMPLES))) / 2


def vertices(line: np.ndarray, rest: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """The simulated cloud of a centre line (L, 3) in float64, (RINGS * RING_VERTICES, 3)."""
    edge, arc = np.diff(line.astype(float), axis=0), np.concatenate([[0.0], np.cumsum(rest)])
    length = np.linalg.norm(edge, axis=1)
    at = (np.arange(RINGS) + 0.5) / RINGS * arc[-1]
    on = np.searchsorted(arc, at, side="right") - 1
    centre = np.column_stack([np.interp(at, arc, line[:, c]) for c in range(3)])
    along = edge[on] / length[on][:, None]
    first = np.cross(np.cross(along, camera - centre), along)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    angle = 2 * np.pi * np.arange(RING_VERTICES) / RING_VERTICES
    around = np.multiply.outer(np.cos(angle), first)
    around += np.multiply.outer(np.sin(angle), np.cross(along, first))
    thick = RADIUS * np.sqrt(rest / np.maximum(length, rest / 4))[on]
    return (centre + thick[:, None] * around).reshape(-1, 3)


def by_mesh(cloud: np.ndarray, line: np.ndarray, rest: np.ndarray) -> float:
    pairs = cdist(cloud, vertices(line, rest, ASIDE))
    return (pairs.min(0).mean() + pairs.min(1).mean()) / 2


@pytest.mark.parametrize(("surface", "reference"), [("tube", by_tube), ("mesh", by_mesh)])
def test_equals_the_reference(surface, reference) -> None:
    rng = np.random.default_rng(1)
    sizes = [1, 15, 16, 17, 100, 33, 1000]
    lines = straight(len(sizes))[None] + rng.normal(0, 0.02, (3, len(sizes), 25, 3))
    lines = lines.astype(np.float32)
    clouds = [
        (lines[0, k][rng.integers(0, 25, size)] + rng.normal(0, 0.01, (size, 3))).astype(np.float32)
        for k, size in enumerate(sizes)
    ]
    expected = [[reference(c, line[k], GRADED) for k, c in enumerate(clouds)] for line in lines]
    seen = chamfer_of(clouds, surface=surface, rest=GRADED)(lines)
    np.testing.assert_allclose(seen, expected, rtol=2e-5, atol=1e-7)


@SURFACES
@pytest.mark.parametrize("lanes", LANES.values())
def test_what_is_skipped_changes_no_bit(surface, lanes: int, monkeypatch) -> None:
    """Lines near and far, crumpled, of edges far too long, at a point, huge, and broken ones."""
    monkeypatch.setitem(LANES, "cpu", lanes)  # a vector as wide as a warp, too
    lines, clouds = by_spreads(12)
    lines[9], lines[10, :, 7], lines[11, :, 20] = np.nan, np.nan, np.inf
    distances, whole = (
        chamfer_of(clouds, surface=surface, culled=culled)(lines) for culled in (True, False)
    )
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


def test_of_a_mesh_the_side_that_no_camera_sees_counts_too() -> None:
    """A cloud on the ridge: a vertex at the angle a is 2 R sin(a / 2) away."""
    distance = chamfer_of([facing(20_000)], FAR_UP, "mesh")(straight(1)[None])[0, 0]
    angle = 2 * np.pi * np.arange(RING_VERTICES) / RING_VERTICES
    back, there = (2 * RADIUS * np.abs(np.sin(angle / 2))).mean(), LENGTH / RINGS / 4
    assert distance == pytest.approx((back + there) / 2, rel=0.01)


@SURFACES
def test_an_empty_frame_and_a_broken_rollout_are_nan_and_change_no_other(surface) -> None:
    def distances(clouds, broken: int | None = None):
        lines = np.tile(straight(len(clouds)) + 0.01, (2, 1, 1, 1))
        if broken is not None:
            lines[1, broken, 7] = np.nan
        return chamfer_of(clouds, surface=surface)(lines)

    empty = np.zeros((0, 3), np.float32)
    frames = distances([empty, facing(), empty, facing(50)], broken=3)
    assert np.isnan(frames[:, [0, 2]]).all() and np.isnan(frames[1, 3])
    whole = distances([facing(), facing(50)])
    np.testing.assert_array_equal(frames[:, 1], whole[:, 0])
    assert frames[0, 3] == whole[0, 1]
    assert np.isnan(distances([empty])).all()


@SURFACES
def test_the_text_compiles_for_a_gpu(surface, tmp_path) -> None:
    """For Hopper, by the compiler that comes with Warp: no GPU is asked for."""
    kernel, _ = chamfer_kernel(surface, 24, LANES["cuda"])
    wp.compile_aot_module(kernel.module, arch=90, module_dir=tmp_path, use_ptx=True)
    (file,) = tmp_path.glob("*.ptx")
    text = file.read_text()
    assert ".target sm_90" in text and "shfl.sync" in text  # threads share a frame
