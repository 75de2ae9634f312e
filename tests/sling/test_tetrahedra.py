"""The tetrahedral mesh through the same solver: energy, hand, clamps, launch, locking."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.sling import Sling, interact, launch
from pipeline.sling.cylinder import cylinder, volumes
from pipeline.sling.initial import clamp_tangents, drawn_guess, hanging_guess, sections_of
from pipeline.sling.launch import schedule_of
from pipeline.sling.material import material
from pipeline.sling.model import GRAVITY, TETRAHEDRA
from pipeline.sling.solver import (
    FAILURE,
    FREE,
    HELD,
    HELD_FORCE,
    LANE_STATE,
    OPENING,
    PAYLOAD,
    RELAX_STEPS,
    Schedule,
    relaxation,
    run,
    steps,
)

from .test_interaction import BASE, random_thetas

THETA = [2.5e5, 0.45, 2e-3, 0.5, 1.0]
DRAW = [-0.38, -0.2]


@pytest.fixture(scope="module")
def solid(sling, params):
    resolution = params.sling.model_copy(update={"mesh": TETRAHEDRA})
    return replace(sling, mesh=TETRAHEDRA, edges=resolution.tet_edges, steps=resolution)


@pytest.fixture(scope="module")
def straight(solid):
    return replace(
        solid, half_width=solid.rest_length / 2, clamp_direction=np.array([1.0, 0.0, 0.0])
    )


def straight_sections(sling, stretch=1.0):
    nodes = np.zeros((sling.sections, 3))
    nodes[:, 0] = stretch * (sling.arc - sling.rest_length / 2)
    return sections_of(sling, nodes)


def settled(sling, theta, start):
    result = run(
        sling,
        Schedule(relaxation(FREE), first_free=0),
        material(sling, np.array([theta])),
        start,
        np.zeros((1, LANE_STATE)),
        double=True,
    )
    assert result.lane_state[0, FAILURE] == 0
    return result.state[0]


def forces(sling, theta, sections):
    """Minus the slope of the elastic energy by each vertex, shape (L, 7, 3), in NumPy."""
    mu, lam = material(sling, np.array([theta]))[0, :2]
    rest, corners = cylinder(sling.arc, 2 * sling.radius)
    before = rest.reshape(-1, 3)[corners]
    inverse = np.linalg.inv(np.swapaxes(before[:, 1:] - before[:, :1], 1, 2))
    volume = volumes(rest, corners)

    def densities(places):
        edges = np.swapaxes(places[:, 1:] - places[:, :1], 1, 2)
        f = edges @ inverse
        j = np.linalg.det(f)
        squares = (f**2).sum(axis=(1, 2))
        return volume * (mu / 2 * (squares - 3) - mu * (j - 1) + lam / 2 * (j - 1) ** 2)

    places, result = sections.reshape(-1, 3)[corners], np.zeros((sling.sections * 7, 3))
    for corner in range(4):
        for axis in range(3):
            moved = np.zeros((4, 3))
            moved[corner, axis] = 1e-7
            slope = (densities(places + moved) - densities(places - moved)) / 2e-7
            np.add.at(result[:, axis], corners[:, corner], -slope)
    return result.reshape(sling.sections, 7, 3)


def test_hanging_band_is_an_equilibrium_of_the_energy(solid):
    sections = settled(solid, THETA, hanging_guess(solid))
    pull = forces(solid, THETA, sections).sum(axis=1)[1:-1]
    weight = solid.mass / solid.edges * GRAVITY
    assert np.abs(pull - [0.0, 0.0, weight]).max() < 0.02 * weight
    assert sections[solid.middle, 2] < -0.15


def test_hand_feels_what_the_drawn_band_pulls_with(solid):
    """The force on the hand is that of the energy on the held section, and the sections' weight."""
    table = schedule_of(solid).table[:RELAX_STEPS]
    lane = np.zeros((1, LANE_STATE))
    lane[0, PAYLOAD] = solid.projectile_mass
    start = drawn_guess(solid, np.array([DRAW]))
    done = run(
        solid, Schedule(table, RELAX_STEPS), material(solid, np.array([THETA])), start, lane,
        double=True,
    )  # fmt: skip
    held = forces(solid, THETA, done.state[0])[solid.middle].sum(axis=0)
    held[2] -= (solid.projectile_mass + solid.mass / solid.edges) * GRAVITY
    assert done.lane_state[0, HELD_FORCE] == pytest.approx(held, abs=1e-4 * np.abs(held).max())
    assert np.allclose(done.state[0, solid.middle], start[0, solid.middle], atol=1e-6)


def test_thin_band_pulls_as_a_string_the_finer_its_mesh(solid):
    """The closed form of test_statics.py; a clamp keeps a slab's length from thinning."""
    gaps = []
    for edges in (52, 104):
        thin = replace(solid, radius=solid.radius / 4, mass=1e-4, projectile_mass=1e-6, edges=edges)
        mu, lam = material(thin, np.array([THETA]))[0, :2]
        half = np.hypot(0.4, thin.half_width)
        stretch = 2 * half / thin.rest_length
        volume = 1 + mu / lam * (1 - 1 / stretch)
        expected = 2 * thin.area * mu * (stretch - volume / stretch**2) * 0.4 / half
        gaps.append(launch(thin, THETA, [-0.4, 0.0]).hold_force[0] / expected - 1)
    assert 0 < gaps[0] < 0.02
    assert gaps[1] == pytest.approx(gaps[0] / 2, rel=0.1)


def test_coarse_tetrahedra_lock_in_bending(straight):
    """5.4 times Euler-Bernoulli's stiffness at nu 0.45: known of meshes like the paper's."""
    light = replace(straight, mass=straight.mass / 200)
    sections = settled(light, [1e7, 0.45, 2e-3, 0.5, 1.0], straight_sections(light))
    load, inertia = light.mass * GRAVITY / light.rest_length, np.pi * light.radius**4 / 4
    sag = load * light.rest_length**4 / (384 * 1e7 * inertia)
    assert sag / -sections[light.middle, 2] == pytest.approx(5.4, rel=0.03)


def test_free_band_falls_as_one_mass(straight):
    """Whatever it does in itself: with backward Euler its centre has fallen g h^2 n (n + 1) / 2."""
    free = replace(straight, clamped=(False, False))
    h, count = 1e-3, 20
    table = steps(h * np.arange(count + 1), h, hold=FREE)
    start = straight_sections(free, 1.3)
    done = run(
        free, Schedule(table, count), material(free, np.array([THETA])), start,
        np.zeros((1, LANE_STATE)), double=True, tolerance=1e-10,
    )  # fmt: skip
    rest, corners = cylinder(free.arc, 2 * free.radius)
    mass = np.bincount(corners.ravel(), np.repeat(volumes(rest, corners), 4)).reshape(-1, 7)
    mass[[0, -1]] = mass[1] / 2  # by the section, not by which way the diagonals run
    before, after = (
        np.average(x.reshape(-1, 3), axis=0, weights=mass.ravel()) for x in (start, done.state[0])
    )
    assert done.state[0, 0, 0] > start[0, 0] + 0.01  # it does contract
    fall = GRAVITY * h**2 * count * (count + 1) / 2
    assert after - before == pytest.approx([0.0, 0.0, -fall], abs=1e-8)


def test_clamps_and_fingers_hold_whole_sections(solid, episode):
    rollouts = interact(solid, episode, BASE)
    assert rollouts.failure == [None]
    held = (rollouts.cloud_time > 1.0) & (rollouts.cloud_time < 2.35)
    hand = np.stack(
        [np.interp(rollouts.cloud_time, episode.time, column) for column in episode.position.T], 1
    )
    assert np.abs(rollouts.center_line[0, :, solid.middle] - hand)[held].max() < 2e-3
    assert rollouts.center_line[0, :, [0, -1]] == pytest.approx(
        np.repeat(solid.tips[:, None], len(rollouts.cloud_time), axis=1), abs=1e-6
    )
    clear = episode.release_time + solid.finger_opening_time
    assert np.all(rollouts.force[0][rollouts.times > clear + 1e-6] == 0)


def test_clamps_set_the_sections_across_their_direction(solid):
    tilted = replace(solid, clamp_direction=np.array([0.6, 0.0, -0.8]), clamp_twist=0.3)
    ends = hanging_guess(tilted)[[0, -1]].reshape(2, 7, 3)
    for end, tip, tangent in zip(ends, tilted.tips, clamp_tangents(tilted), strict=True):
        assert end[0] == pytest.approx(tip)
        assert (end - tip) @ tangent == pytest.approx(np.zeros(7), abs=1e-9)


def test_pulls_and_launches_nearly_as_the_rod(sling, solid, episode):
    """Force within 3 %, speed within 2 % of the rod's: held sections and locking stiffen it."""
    rod, tets = (interact(one, episode, BASE) for one in (sling, solid))
    drawn = np.argmin(np.abs(rod.times - 2.3))
    assert tets.force[0, drawn, 1] == pytest.approx(rod.force[0, drawn, 1], rel=0.03)
    rod, tets = (launch(one, THETA, DRAW) for one in (sling, solid))
    assert tets.failure == [None]
    assert tets.speed == pytest.approx(rod.speed, rel=0.02)
    assert rod.speed < tets.speed


def test_random_thetas_converge_whatever_their_neighbours(solid, episode):
    strong = replace(solid, grip_force=1e5)
    thetas = random_thetas(40, seed=4)
    together = interact(strong, episode, thetas, workers=2)
    assert together.failure == [None] * 40
    assert np.isfinite(together.force).all() and np.isfinite(together.center_line).all()
    alone = interact(strong, episode, thetas[7])
    assert np.array_equal(together.force[7], alone.force[0])


def test_mesh_is_chosen_in_params_and_not_for_a_gpu(params):
    band = params.bands["band1"]
    chosen = params.sling.model_copy(update={"mesh": TETRAHEDRA})
    solid = Sling.of(band, params.setup, chosen)
    assert (solid.sections, solid.dofs) == (53, 21)
    assert Sling.of(band, params.setup, params.sling).dofs == 9
    with pytest.raises(UserError, match="CPU"):
        launch(solid, THETA, DRAW, device="cuda:0")


def held_steps(solid, count=20):
    """Rows that hold a drawn band at rest, and that move the hand by 1 m/s."""
    relax = relaxation(HELD)
    moving = steps(0.005 * np.arange(count + 1), 0.005, hold=HELD)
    relax[:, 6:9] = 0.0, *DRAW
    moving[:, 6:9] = np.array([0.0, *DRAW]) - np.outer(np.arange(1, count + 1), [0.0, 5e-3, 0.0])
    for table in (relax, moving):
        table[:, 9], table[:, 10] = 1e4, 0.0
    return relax, moving


def stepped(solid, table, **options):
    return run(
        solid,
        Schedule(table, first_free=len(table)),
        material(solid, np.array([THETA])),
        drawn_guess(solid, np.array([DRAW])),
        np.zeros((1, LANE_STATE)),
        frame_steps=np.arange(len(table)),
        frame_weights=np.ones(len(table)),
        frame_width=solid.dofs,
        **options,
    )


def test_force_of_a_moving_hand_is_converged(solid):
    """Within 1e-4 of Newton's method to rounding, though it stops much sooner."""
    table = np.vstack(held_steps(solid))
    quick, exact = (stepped(solid, table, double=True, tolerance=t) for t in (2e-6, 1e-12))
    force = exact.output[0, RELAX_STEPS:, :3]
    assert exact.output[0, :, 3].sum() > 1.3 * quick.output[0, :, 3].sum()
    assert np.abs(quick.output[0, RELAX_STEPS:, :3] - force).max() < 1e-4 * np.abs(force).max()


def test_held_section_is_the_rest_section_across_the_fork(solid):
    section = stepped(solid, held_steps(solid)[0]).frames[0, -1, solid.middle].reshape(7, 3)
    rest = cylinder([0.0, 1.0], 2 * solid.radius)[0][0]
    assert section - section[0] == pytest.approx(rest, abs=1e-6)


def test_pads_that_open_without_friction_to_lose_hold_the_band_where_it_is(solid):
    """Friction that makes up for the whole pull, shared by the section's vertices as their mass."""
    relax, moving = held_steps(solid)
    opening = moving.copy()
    opening[:, 0], opening[:, 5], opening[:, 9] = 2.5e-4, OPENING, 0.0
    frames = stepped(solid, np.vstack([relax, opening])).frames[0, RELAX_STEPS - 1 :]
    shift = frames[:, solid.middle].reshape(-1, 7, 3).mean(axis=1) - frames[0, solid.middle, :3]
    assert np.abs(shift).max() < 1e-3
