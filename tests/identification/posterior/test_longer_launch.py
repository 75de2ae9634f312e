"""Launches that flew further or shorter than simulated, in the simulator itself."""

import numpy as np
import pytest

from sling2sim2real.identification.posterior.coordinates import Coordinates
from sling2sim2real.identification.posterior.launches import LaunchLikelihood, Observed
from sling2sim2real.identification.results.theta import load_sling
from sling2sim2real.simulator.launch import launch
from sling2sim2real.simulator.model import LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from tests.project import with_
from validation.projects import ROUGH

THETA = Parameters.of("rubber", [5e5, 0.47, 5e-3, 0.7, 0.6], relaxation=0.02)
DRAW, FURTHER, SHARE = (-0.30, -0.17), 1.04, "log_returned_share"


@pytest.fixture(scope="module")
def world(params):
    """A band, its setup, the density's coordinates, and where they are."""
    rough = with_(params, "sling", **ROUGH)
    sling = load_sling(rough, "band1", None, "rubber")
    setup = LaunchSetup.of(rough.setup, rough.sling, LaunchHistory(1.0, 0.5))
    coordinates = Coordinates.of_method(rough, "posterior", sling)
    return sling, setup, coordinates, coordinates.of(THETA)


def moved_by(
    world, observed: Observed, certain: float = 0.1, share: float | None = None
) -> dict[str, float]:
    """How a launch moves coordinates that recordings show within `certain` each.

    Args:
        share: Standard deviation of the returned share's logarithm; None: as the others.
    """
    sling, setup, coordinates, phi = world
    told = LaunchLikelihood([observed], sling, setup).expand(
        coordinates.parameters, phi, coordinates.steps
    )
    precision = coordinates.precision + certain**-2
    if share is not None:
        precision[coordinates.names.index(SHARE)] = share**-2
    moved = np.linalg.solve(np.diag(precision) + told.landed.hessian, told.landed.gradient)
    return dict(zip(coordinates.names, moved, strict=True))


def flown(world, draw: tuple[float, float], share: float = 1.0) -> dict[str, float]:
    """Landing, speed and angle of a launch that returns a share of what the law gives it."""
    sling, setup, coordinates, phi = world
    phi = phi + np.log(share) * (np.array(coordinates.names) == SHARE)
    once = launch(sling, setup, coordinates.parameters(phi[None]), np.array([draw]))
    assert once.failure[0] is None
    return {
        "landing": float(once.landing_y[0]),
        "speed": float(once.speed[0]),
        "angle": float(once.angle[0]),
    }


def test_a_longer_launch_gives_back_more_or_loses_less(world) -> None:
    landing = FURTHER * flown(world, DRAW)["landing"]
    moved = moved_by(world, Observed(DRAW, 0.001, landing))
    assert moved[SHARE] > 0
    assert moved["log_loss_factor"] < 0


def test_a_speed_parts_lost_energy_from_a_wrong_aim(world) -> None:
    """Both land short by the same. One lost energy; the other was drawn flatter, as far out."""
    for degrees in (1,2,3):
        turn = np.deg2rad(degrees)
        flatter = np.array(DRAW) @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
        aside = flown(world, tuple(flatter))
        for error in (0.001, 0.003,0.005):
          for name, one in (("lost", flown(world, DRAW, 0.94)), ("aside", aside)):
            by_landing = Observed(DRAW, error, one["landing"])
            by_speed = Observed(DRAW, error, one["landing"], one["speed"])
            by_all = Observed(DRAW, error, **one)
            print(degrees, error, name, one, [round(moved_by(world, x, 1e-3, 0.1)[SHARE],4) for x in (by_landing, by_speed, by_all)])
    assert 0
