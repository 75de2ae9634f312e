"""The tetrahedral mesh through the same solver: energy, hand, clamps, launch, locking."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.simulator import ClampedBand, interact, launch
from pipeline.simulator.cylinder import cylinder, volumes
from pipeline.simulator.initial import clamp_tangents, drawn_guess, hanging_guess
from pipeline.simulator.launch import schedule_of
from pipeline.simulator.model import GRAVITY, TETRAHEDRA
from pipeline.simulator.records import Grip
from pipeline.simulator.schedule import RELAX_STEPS, Schedule, relaxation, steps
from pipeline.simulator.solver import Frames, Options, Slings, run
from tests.simulator.bands import DRAW, THETA, at_rest, neo, random_thetas, stepped
from validation.simulator.closed import String


def forces(sling, theta, sections):
    """Minus the slope of the elastic energy by each vertex, shape (L, 7, 3), in NumPy."""
    string = String.of(sling, theta)
    mu, lam = string.mu, string.lam
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
    sections = at_rest(solid, neo(THETA), hanging_guess(solid))
    pull = forces(solid, THETA, sections).sum(axis=1)[1:-1]
    weight = solid.mass / solid.edges * GRAVITY
    assert np.abs(pull - [0.0, 0.0, weight]).max() < 0.02 * weight
    assert sections[solid.middle, 2] < -0.15


def test_hand_feels_what_the_drawn_band_pulls_with(solid, launch_setup):
    """The force on the hand is that of the energy on the held section, and the sections' weight."""
    table = schedule_of(launch_setup).steps[:RELAX_STEPS]
    start = drawn_guess(solid, np.array([DRAW]))
    done = stepped(solid, table, neo(THETA), start, payload=launch_setup.projectile_mass)
    held = forces(solid, THETA, done.state[0])[solid.middle].sum(axis=0)
    held[2] -= (launch_setup.projectile_mass + solid.mass / solid.edges) * GRAVITY
    assert done.lanes["hold_force"][0] == pytest.approx(held, abs=1e-4 * np.abs(held).max())
    assert np.allclose(done.state[0, solid.middle], start[0, solid.middle], atol=1e-6)


def test_thin_band_pulls_as_a_string_the_finer_its_mesh(solid, launch_setup):
    """The closed form of test_statics.py; a clamp keeps a slab's length from thinning."""
    gaps, launch_setup = [], replace(launch_setup, projectile_mass=1e-6)
    for edges in (26, 52):
        thin = replace(solid, radius=solid.radius / 4, mass=1e-4, edges=edges)
        half = np.hypot(0.4, thin.half_width)
        pull = String.of(thin, THETA).force(2 * half / thin.rest_length)
        expected = 2 * pull * 0.4 / half
        gaps.append(
            launch(thin, launch_setup, neo(THETA), [-0.4, 0.0]).hold_force[0] / expected - 1
        )
    assert 0 < gaps[1] < 0.02
    assert gaps[1] == pytest.approx(gaps[0] / 2, rel=0.1)


def test_clamps_set_the_sections_across_their_direction(solid):
    tilted = replace(solid, clamp_direction=np.array([0.6, 0.0, -0.8]), clamp_twist=0.3)
    ends = hanging_guess(tilted)[[0, -1]].reshape(2, 7, 3)
    for end, tip, tangent in zip(ends, tilted.tips, clamp_tangents(tilted), strict=True):
        assert end[0] == pytest.approx(tip)
        assert (end - tip) @ tangent == pytest.approx(np.zeros(7), abs=1e-9)


def test_random_thetas_converge_whatever_their_neighbours(solid, episode):
    strong, thetas = replace(solid, grip_force=1e5), random_thetas(20, seed=4)
    together = interact(strong, episode, neo(thetas), workers=2)
    assert together.failure == [None] * 20
    assert np.isfinite(together.force).all() and np.isfinite(together.center_line).all()
    alone = interact(strong, episode, neo(thetas[7]))
    assert np.array_equal(together.force[7], alone.force[0])


def test_mesh_is_chosen_in_params_and_not_for_a_gpu(params, launch_setup):
    band = params.bands["band1"]
    chosen = params.sling.model_copy(update={"mesh": TETRAHEDRA})
    solid = ClampedBand.of(band, params.setup, chosen)
    assert (solid.sections, solid.dofs) == (53, 21)
    assert ClampedBand.of(band, params.setup, params.sling).dofs == 9
    with pytest.raises(UserError, match="CPU"):
        launch(solid, launch_setup, neo(THETA), DRAW, device="cuda:0")


def held_steps(count=20):
    """Steps that hold a drawn band at rest, and that move the hand by 1 m/s."""
    relax = relaxation(Grip.HELD)
    moving = steps(0.005 * np.arange(count + 1), 0.005, grip=Grip.HELD)
    relax["target"] = 0.0, *DRAW
    moving["target"] = relax["target"][0] - np.outer(np.arange(1, count + 1), [0.0, 5e-3, 0.0])
    relax["grip_force"] = moving["grip_force"] = 1e4
    return relax, moving


def recorded(solid, table, **options):
    """All of the mesh after each step."""
    count = len(table)
    slings = Slings.of(solid, neo(THETA), drawn_guess(solid, np.array([DRAW])))
    frames = Frames(np.arange(count), np.ones(count), solid.dofs)
    return run(solid, Schedule(table, count), slings, frames, Options(**options))


def test_force_of_a_moving_hand_is_converged(solid):
    """Within 1e-4 of Newton's method to rounding, though it stops much sooner."""
    table = np.concatenate(held_steps())
    quick, exact = (recorded(solid, table, double=True, tolerance=t) for t in (2e-6, 1e-12))
    force = exact.output[0, RELAX_STEPS:, :3]
    assert exact.output[0, :, 3].sum() > 1.3 * quick.output[0, :, 3].sum()
    assert np.abs(quick.output[0, RELAX_STEPS:, :3] - force).max() < 1e-4 * np.abs(force).max()


def test_held_section_is_the_rest_section_across_the_fork(solid):
    section = recorded(solid, held_steps()[0]).frames[0, -1, solid.middle].reshape(7, 3)
    rest = cylinder([0.0, 1.0], 2 * solid.radius)[0][0]
    assert section - section[0] == pytest.approx(rest, abs=1e-6)


def test_pads_that_open_without_friction_to_lose_hold_the_band_where_it_is(solid):
    """Friction that makes up for the whole pull, shared by the section's vertices as their mass."""
    relax, opening = held_steps()
    opening["h"], opening["grip"], opening["grip_force"] = 2.5e-4, Grip.OPENING, 0.0
    frames = recorded(solid, np.concatenate([relax, opening])).frames[0, RELAX_STEPS - 1 :]
    shift = frames[:, solid.middle].reshape(-1, 7, 3).mean(axis=1) - frames[0, solid.middle, :3]
    assert np.abs(shift).max() < 1e-3
