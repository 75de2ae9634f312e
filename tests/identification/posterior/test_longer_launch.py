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
DRAW, FURTHER = (-0.30, -0.17), 1.04


@pytest.fixture(scope="module")
def world(params):
    """A band, its setup, the density's coordinates, and where they are."""
    rough = with_(params, "sling", **ROUGH)
    sling = load_sling(rough, "band1", None, "rubber")
    setup = LaunchSetup.of(rough.setup, rough.sling, LaunchHistory(1.0, 0.5))
    coordinates = Coordinates.of_method(rough, "posterior", sling)
    return sling, setup, coordinates, coordinates.of(THETA)


def moved_by(world, observed: Observed, certain: float = 0.1) -> dict[str, float]:
    """How a launch moves coordinates that recordings show within `certain` each."""
    sling, setup, coordinates, phi = world
    told = LaunchLikelihood([observed], sling, setup).expand(
        coordinates.parameters, phi, coordinates.steps
    )
    precision = np.diag(coordinates.precision + certain**-2)
    moved = np.linalg.solve(precision + told.landed.hessian, told.landed.gradient)
    return dict(zip(coordinates.names, moved, strict=True))


def flown(world, draw: tuple[float, float], share: float = 1.0) -> dict[str, float]:
    """Landing, speed and angle of a launch that returns a share of what the law gives it."""
    sling, setup, coordinates, phi = world
    phi = phi + np.log(share) * (np.array(coordinates.names) == "log_returned_share")
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
    assert moved["log_returned_share"] > 0
    assert moved["log_loss_factor"] < 0


def test_a_speed_parts_lost_energy_from_a_wrong_aim(world) -> None:
    """Both launches land short. One was drawn 12 mm too low and has all its energy."""
    lost, wrong = flown(world, DRAW, share=0.96), flown(world, (DRAW[0], DRAW[1] - 0.012))
    error, sure = 0.012, 1e-3
    share = {}
    for name, launched in (("lost", lost), ("wrong", wrong)):
        by_landing = Observed(DRAW, error, launched["landing"])
        by_all = Observed(DRAW, error, **launched)
        share[name] = [moved_by(world, it, sure)["log_returned_share"] for it in (by_landing, by_all)]
    print(lost, wrong, flown(world, DRAW), share)
    assert 0
