"""The air's drag on the band: a force for mass and speed, which the projectile does not feel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.sling.cylinder import cylinder, volumes
from pipeline.sling.initial import sections_of
from pipeline.sling.interaction import interact
from pipeline.sling.launch import launch
from pipeline.sling.material import material
from pipeline.sling.model import GRAVITY, ROD, TETRAHEDRA, Sling
from pipeline.sling.solver import FREE, LANE_STATE, PAYLOAD, Schedule, run, steps

THETA = [3e5, 0.45, 2e-3, 0.5, 1.0]
H, COUNT = 1e-3, 60


def fallen(sling: Sling, drags: np.ndarray, payload: float = 0.0) -> np.ndarray:
    """How far the middle (of a mesh, the centre) of loose bands falls with each drag [1/s], (N,).

    Args:
        payload: At the middle [kg].
    """
    loose = replace(sling, clamped=(False, False), air_drag=drags)
    nodes = np.column_stack([sling.arc, np.zeros((sling.sections, 2))])
    lane_state = np.zeros((len(drags), LANE_STATE))
    lane_state[:, PAYLOAD] = payload
    table = steps(H * np.arange(COUNT + 1), H, hold=FREE)
    start = sections_of(loose, nodes)
    done = run(
        loose, Schedule(table, COUNT), material(loose, np.array([THETA] * len(drags))), start,
        lane_state, double=True, tolerance=1e-10,
    )  # fmt: skip
    if sling.mesh == ROD:
        return start[sling.middle, 2] - done.state[:, sling.middle, 2]
    return np.average(
        start[:, 2::3] - done.state[:, :, 2::3],
        axis=(1, 2),
        weights=np.broadcast_to(masses(sling), (len(drags), *masses(sling).shape)),
    )


def masses(sling: Sling) -> np.ndarray:
    """Share of each vertex, shape (sections, vertices)."""
    rest, corners = cylinder(sling.arc, 2 * sling.radius)
    mass = np.bincount(corners.ravel(), np.repeat(volumes(rest, corners), 4)).reshape(-1, 7)
    mass[[0, -1]] = mass[1] / 2  # by the section, not by which way the diagonals run
    return mass


def fall(rate: float) -> float:
    """Of one mass: backward Euler of v' = -g - rate v, which is exact for these steps."""
    speed = place = 0.0
    for _ in range(COUNT):
        speed = (speed + H * GRAVITY) / (1 + H * rate)
        place += H * speed
    return place


@pytest.mark.parametrize("mesh", [ROD, TETRAHEDRA])
def test_a_loose_band_falls_as_one_mass_in_the_wind(sling, params, mesh):
    band = params.bands["band1"]
    shape = params.sling.model_copy(update={"mesh": mesh})
    drags = np.array([0.0, 3.0, 40.0])
    found = fallen(Sling.of(band, params.setup, shape), drags)
    assert found == pytest.approx([fall(drag) for drag in drags], rel=1e-5)


def test_the_projectile_feels_no_wind(sling):
    """A stiff band with a load at its middle falls as both masses with the drag of one."""
    stiff = replace(sling, rest_length=0.02, mass=0.02)
    (found,) = fallen(stiff, np.array([30.0]), payload=0.04)
    assert found == pytest.approx(fall(30.0 * 0.02 / 0.06), rel=0.02)


def test_drag_differs_by_rollout_and_slows_the_recoil(strong_grip, episode):
    """Three drags in one batch, each as if alone; the swing loses speed."""
    drags = np.array([0.0, 2.0, 6.0])
    both = interact(replace(strong_grip, air_drag=drags), episode, np.array([THETA] * 3))
    for drag, line in zip(drags, both.center_line, strict=True):
        alone = interact(replace(strong_grip, air_drag=drag), episode, np.array([THETA]))
        np.testing.assert_array_equal(alone.center_line[0], line)
    swing = both.cloud_time > episode.release_time + 0.2
    moved = np.abs(np.diff(both.center_line[:, swing, strong_grip.middle], axis=1)).sum((1, 2))
    assert moved[0] > 1.05 * moved[1] > 1.05**2 * moved[2]


def test_drag_shortens_a_launch(sling):
    draw = np.array([[-0.33, -0.17]])
    landings = [
        launch(replace(sling, air_drag=drag), np.array([THETA]), draw).landing_y[0]
        for drag in (0.0, 3.0)
    ]
    assert 0.93 < landings[1] / landings[0] < 0.995
