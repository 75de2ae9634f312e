"""A launch that flew further than simulated, in the simulator itself."""

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
def summary(params):
    """Coordinates, where they stand, and what was known and is with launches from DRAW."""
    rough = with_(params, "sling", **ROUGH)
    sling = load_sling(rough, "band1", None, "rubber")
    setup = LaunchSetup.of(rough.setup, rough.sling, LaunchHistory(1.0, 0.5))
    coordinates = Coordinates.of_method(rough, "posterior", sling)
    phi = coordinates.of(THETA)
    once = launch(sling, setup, coordinates.parameters(phi[None]), np.array([DRAW]))
    assert once.failure[0] is None

    def by(count: int):
        observed = [Observed(DRAW, 0.001, FURTHER * float(once.landing_y[0]))] * count
        told = LaunchLikelihood(observed, sling, setup).expand(
            coordinates.parameters, phi, coordinates.steps
        )
        return precision + told.landed.hessian, told.landed.gradient

    precision = np.diag(coordinates.precision + 1e2)  # as if recordings showed each within 0.1
    return coordinates.names, precision, by


def test_a_longer_launch_gives_back_more_or_loses_less(summary) -> None:
    names, _, by = summary
    moved = dict(zip(names, np.linalg.solve(*by(1)), strict=True))
    assert moved["log_returned_share"] > 0
    assert moved[names[1]] < 0  # the loss factor


def test_two_launches_narrow_what_one_leaves_open(summary) -> None:
    names, precision, by = summary
    single, double = (np.linalg.inv(by(count)[0]) for count in (1, 2))
    place = names.index("log_returned_share")
    assert double[place, place] < single[place, place] < 1 / precision[place, place]
    assert (np.linalg.eigvalsh(single - double) > -1e-9).all()
