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
    """Both land short. One lost 6 % of its energy; the other was drawn 2 degrees flatter."""
    (y, z), turn = DRAW, np.deg2rad(-2.0)
    flatter = y * np.cos(turn) - z * np.sin(turn), y * np.sin(turn) + z * np.cos(turn)
    lost, aside = flown(world, DRAW, share=0.94), flown(world, flatter)
    assert max(lost["landing"], aside["landing"]) < 0.99 * flown(world, DRAW)["landing"]

    def share(**measured: float) -> float:
        return moved_by(world, Observed(DRAW, 0.005, **measured), certain=1e-3, share=0.1)[SHARE]

    assert share(landing=aside["landing"]) < -0.01
    assert abs(share(**aside)) < 0.2 * abs(share(landing=aside["landing"]))
    assert share(**lost) < 0.95 * share(landing=lost["landing"]) < -0.03
