"""The Chamfer distance of two clouds, against other libraries and shapes with known answers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from sling2sim2real.identification.objective.chamfer import (
    AROUND,
    LANES,
    RINGS,
    Chamfer,
    CloudDistance,
)
from tests.identification.objective.toy import (
    LENGTH,
    RADIUS,
    by_spreads,
    episode,
    facing,
    loss_of,
    rollouts,
    straight,
)  # fmt: skip

CAMERA = np.array([0.0, 0.0, 1e4])
ASIDE = np.array([1.0, -0.8, 0.6])
TUBE = {"radius": RADIUS, "rest_length": LENGTH}


def vertices(line: np.ndarray, rest: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """The simulated cloud of a centre line (L, 3) in float64, (RINGS * AROUND, 3)."""
    edge, arc = np.diff(line.astype(float), axis=0), np.concatenate([[0.0], np.cumsum(rest)])
    length = np.linalg.norm(edge, axis=1)
    at = (np.arange(RINGS) + 0.5) / RINGS * arc[-1]
    on = np.searchsorted(arc, at, side="right") - 1
    centre = np.column_stack([np.interp(at, arc, line[:, c]) for c in range(3)])
    along = edge[on] / length[on][:, None]
    first = np.cross(np.cross(along, camera - centre), along)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    around = np.multiply.outer(np.cos(angle), first)
    around += np.multiply.outer(np.sin(angle), np.cross(along, first))
    thick = RADIUS * np.sqrt(rest / np.maximum(length, rest / 4))[on]
    return (centre + thick[:, None] * around).reshape(-1, 3)


def graded() -> np.ndarray:
    """Rest lengths of 24 edges, the first eight times shorter than those midway."""
    sizes = np.geomspace(1, 8, 12)
    return LENGTH * np.concatenate([sizes, sizes[::-1]]) / sizes.sum() / 2


def test_equals_all_pairs_of_scipy() -> None:
    rng = np.random.default_rng(3)
    sizes = [1, 2, 17, 300, 1000]
    lines = straight(len(sizes))[None] + rng.normal(0, 0.02, (2, len(sizes), 25, 3))
    lines = lines.astype(np.float32)
    clouds = [rng.normal(0, 0.1, (size, 3)).astype(np.float32) for size in sizes]
    rest = graded()
    distances = CloudDistance(clouds, ASIDE, radius=RADIUS, rest_length=rest)(lines)
    for line, row in zip(lines, distances, strict=True):
        for k, cloud in enumerate(clouds):
            simulated = vertices(line[k], rest, ASIDE)
            assert simulated.shape == (RINGS * AROUND, 3)
            pairs = cdist(cloud, simulated)
            expected = (pairs.min(0).mean() + pairs.min(1).mean()) / 2
            assert row[k] == pytest.approx(expected, rel=2e-5)


@pytest.mark.parametrize("lanes", LANES.values())
def test_what_is_skipped_changes_no_bit(lanes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines near and far, crumpled, at a point and huge; clouds of all sizes."""
    monkeypatch.setitem(LANES, "cpu", lanes)  # a vector as wide as a warp, too
    lines, clouds = by_spreads(9)
    distances, whole = (
        CloudDistance(clouds, ASIDE, culled=culled, **TUBE)(lines) for culled in (True, False)
    )
    np.testing.assert_array_equal(distances, whole)
    assert np.isfinite(np.delete(distances, 8, axis=1)).all()


def test_the_side_that_no_camera_sees_counts() -> None:
    """A cloud on the ridge: a vertex at the angle a is 2 R sin(a / 2) away."""
    distance = CloudDistance([facing(20_000)], CAMERA, **TUBE)(straight(1)[None])[0, 0]
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    back, there = (2 * RADIUS * np.abs(np.sin(angle / 2))).mean(), LENGTH / RINGS / 4
    assert distance == pytest.approx((back + there) / 2, rel=0.01)
    seen = Chamfer([facing(20_000)], CAMERA, **TUBE)(straight(1)[None])[0, 0]
    assert seen < 0.1 * distance


def test_a_stretched_band_is_thinner() -> None:
    """From far along the band's side: the mean over a ring is of its radius, R / sqrt(2)."""
    away, far = np.array([0.0, 0.0, 10.0]), 2 * straight(1)
    cloud = (np.array([[0.0, 0.0, 0.0]]) + away).astype(np.float32)
    thin = CloudDistance([cloud], CAMERA, **TUBE)(far[None])[0, 0]
    pairs = cdist(cloud, vertices(far[0], np.full(24, LENGTH / 24), CAMERA))
    assert thin == pytest.approx((pairs.min() + pairs.mean()) / 2, rel=1e-5)
    nearest = 10 - RADIUS / np.sqrt(2)
    assert pairs.min() == pytest.approx(nearest, abs=1e-6)


def test_empty_clouds_and_broken_rollouts_are_no_number_and_the_others_stay() -> None:
    lines = np.tile(straight(3), (3, 1, 1, 1))
    lines[1, 2, 7] = np.nan
    distances = CloudDistance([facing(), np.zeros((0, 3)), facing()], CAMERA, **TUBE)(lines)
    assert np.isnan(distances[:, 1]).all() and np.isnan(distances[1, 2])
    np.testing.assert_array_equal(distances[0, [0, 2]], distances[2, [0, 2]])
    assert distances[1, 0] == distances[0, 0] == distances[0, 2]


def test_a_perfect_place_costs_least() -> None:
    recorded = episode(frames=3)
    loss = loss_of(replace(recorded, clouds=[facing(500)] * 3), chamfer="clouds")
    shifts = (-0.01, -0.003, 0.0, 0.003, 0.01)
    geom = [loss.terms(rollouts(recorded, shift=(0, s, 0)))["geom"][0] for s in shifts]
    assert np.argmin(geom) == 2
