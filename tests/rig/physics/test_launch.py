from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import simpson

from pipeline.params import Params
from pipeline.params.virtual_rig import RigFlow, RigSoftening, RigSpectrum
from rig.physics.launch import POINTS, flight, fly, launch, launch_from
from rig.physics.scene import ROD
from rig.physics.world import bent_at, pulled, string_of
from tests.project import with_

DRAW = (-0.30, -0.15)


def test_drag_shortens_the_flight() -> None:
    """Against small explicit steps."""
    position, velocity, k, step = np.zeros(2), np.array([6.0, 2.0]), 0.02, 2e-5
    landing = fly(position, velocity, -0.52, k)
    while position[1] > -0.52:
        position = position + step * velocity
        velocity = velocity + step * ([0.0, -9.81] - k * np.hypot(*velocity) * velocity)
    assert np.isclose(landing, position[0], rtol=1e-4)
    assert landing < 0.99 * fly(np.zeros(2), np.array([6.0, 2.0]), -0.52, 0.0)


def test_a_flight_is_kept_evenly_in_time() -> None:
    """Without drag a parabola from the first point to the floor."""
    position, velocity, floor = np.array([-0.1, -0.05]), np.array([4.0, 1.5]), -0.52
    way = flight(position, velocity, floor, 0.0)
    time = (way[:, 0] - position[0]) / velocity[0]
    assert way.shape == (POINTS, 2) and np.allclose(np.diff(time), time[1], rtol=1e-6)
    height = position[1] + velocity[1] * time - 9.81 * time**2 / 2
    np.testing.assert_allclose(way[:, 1], height, atol=1e-6)
    assert way[-1, 0] == fly(position, velocity, floor, 0.0) and np.isclose(way[-1, 1], floor)
    assert flight(np.array([0.1, floor]), velocity, floor, 0.0).tolist() == [[0.1, floor]]


def test_pouch_pushes_until_the_band_slackens(coarse: Params) -> None:
    """The projectile takes less than the drawn band holds, and most of it."""
    string = string_of(coarse, "band1")
    trial = launch("band1", coarse, DRAW, None)
    force = []
    distances = np.linspace(1.0, 0.6, 5)
    for part in distances:
        at = bent_at(string, part * np.array([0.0, *DRAW]))
        held = string.at_rest(at, coarse.rig.tolerance, held=True)
        force.append(np.linalg.norm(string.at_middle(held)))
    stored = -simpson(force, x=distances * np.hypot(*DRAW))
    energy = coarse.setup.projectile_mass * trial.speed**2 / 2
    assert 0.5 * stored < energy < stored
    assert np.isclose(trial.angle, np.arctan2(-DRAW[1], -DRAW[0]), atol=0.15)


def test_failures_say_why(coarse: Params) -> None:
    strong = launch("band1", with_(coarse, "setup", max_force=5.0), DRAW, None)
    assert strong.failure.startswith("holding takes")
    assert strong.hold_force > 5 and np.isnan(strong.landing_y) and strong.flight is None
    assert "slack" in launch("band1", coarse, (-0.15, -0.1), None).failure
    assert "too short: lands" in launch("band1", coarse, (-0.24, -0.02), None).failure
    far = launch("band1", coarse, (-0.44, -0.28), None)
    assert far.failure.startswith("beyond the area") and far.landing_y > 2.425
    assert far.flight[-1, 0] == far.landing_y


def test_a_low_flight_hits_the_forks_foot(coarse: Params) -> None:
    """It would reach the floor just behind the fork, and meets the bar between the rods."""
    floor = -0.52
    low = np.array([-0.2, floor + 0.03]), np.array([3.0, 0.0])
    assert fly(*low, floor, 0.0) > 0 > fly(*low, floor + ROD, 0.0)
    table = with_(coarse, "setup", fork_height=0.1)
    trial = launch("band1", table, (-0.29, 0.0), None)
    assert trial.failure.startswith("hits the fork") and np.isnan(trial.landing_y)
    assert (trial.flight[:, 0] < 0).all()  # it ends there
    short = launch("band1", table, (-0.24, 0.0), None)
    assert "fell before the fork" in short.failure and np.isnan(short.landing_y)


def test_a_kick_moves_the_landing(coarse: Params) -> None:
    """Along the launch it adds to the speed; equal seeds give every method the same kick."""
    string, aim = string_of(coarse, "band1"), np.array([0.0, *DRAW])
    heading = -aim / np.linalg.norm(aim)
    plain, kicked = (launch_from(string, coarse, aim, k * heading) for k in (0.0, 0.2))
    assert kicked.speed > plain.speed
    calm = with_(coarse, "rig", release_jitter=0.0)
    first, again, other = (launch("band1", params, DRAW, 3) for params in (coarse, coarse, calm))
    assert first == again and first.landing_y != other.landing_y


def test_the_arm_gives_way(coarse: Params) -> None:
    """By force over stiffness; the launch is a firm arm's from there."""
    string, aim, stiffness = string_of(coarse, "band1"), np.array([0.0, *DRAW]), 3000.0
    y = string.at_rest(bent_at(string, aim), 1e-6, held=True, give=1 / stiffness)
    moved = y[string.middle, :3] - aim
    np.testing.assert_allclose(moved, string.at_middle(y) / stiffness, rtol=1e-6, atol=1e-9)
    soft, firm = (with_(coarse, "rig.arm", stiffness=k) for k in (stiffness, 1e9))
    force = launch_from(string, soft, aim).hold_force
    there = aim - aim / np.linalg.norm(aim) * force / stiffness
    near, nearer, far = (
        launch_from(string, *case).landing_y for case in ((soft, aim), (firm, there), (firm, aim))
    )
    assert np.isclose(near, nearer, rtol=2e-3) and near < 0.97 * far


MEMORIES = {
    "spectrum": RigSpectrum(weight=0.1, times=(0.01, 10.0), branches=3, slope=0.0),
    "flow": RigFlow(share=0.3, rate=200.0, power=4.0, chain=-1.0, offset=0.05),
    "softening": RigSoftening(damage=2.0, energy=0.1, growth=0.1),
}


@pytest.mark.parametrize("name", MEMORIES)
def test_every_memory_reaches_the_launch(coarse: Params, name: str) -> None:
    """Relaxation and flow forget in a longer pause; the pull for the recording left a band soft."""
    band = coarse.rig.bands["band1"].model_copy(update={"relaxation": (), name: MEMORIES[name]})
    world = with_(coarse, "rig", bands={"band1": band})
    late = with_(world, "launch", pause=20.0)
    now, then = (launch("band1", params_i, DRAW, None) for params_i in (world, late))
    if name != "softening":
        assert then.hold_force < 0.999 * now.hold_force and then.speed < now.speed
        return
    assert then.hold_force == now.hold_force
    thin, aim = replace(string_of(world, "band1"), diameter=0.001), np.array([0.0, *DRAW])
    _, stretch, _, memory = pulled(thin, aim, again=True)
    elastic = thin.rubber.law.stress(stretch)[0]
    softer = thin.rubber.response(stretch, memory)[0][-1] / elastic[-1]
    light = replace(thin, mass=1e-4)  # bends and weighs next to nothing
    virgin = replace(light, rubber=replace(light.rubber, softening=None))
    held = [launch_from(string, coarse, aim).hold_force for string in (light, virgin)]
    assert softer < 0.9 and np.isclose(held[0] / held[1], softer, rtol=5e-3)


def test_landing_is_converged(params: Params) -> None:
    """Half the edges at ten times the tolerance move a landing by less than half a per cent."""
    string, aim = string_of(params, "band1"), np.array([0.0, *DRAW])
    best = launch_from(string, params, aim).landing_y
    loose = with_(params, "rig", tolerance=10 * params.rig.tolerance)
    coarser = launch_from(replace(string, edges=60), loose, aim).landing_y
    assert np.isclose(coarser, best, rtol=5e-3)
