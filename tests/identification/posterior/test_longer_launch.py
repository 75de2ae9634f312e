"""A launch that flew further than simulated, in the simulator itself."""

import numpy as np

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


def test_a_longer_launch_gives_back_more_or_loses_less(params) -> None:
    rough = with_(params, "sling", **ROUGH)
    sling = load_sling(rough, "band1", None, "rubber")
    setup = LaunchSetup.of(rough.setup, rough.sling, LaunchHistory(1.0, 0.5))
    coordinates = Coordinates.of_method(rough, "posterior", sling)
    phi = coordinates.of(THETA)
    once = launch(sling, setup, coordinates.parameters(phi[None]), np.array([DRAW]))
    assert once.failure[0] is None
    observed = [Observed(DRAW, 0.001, FURTHER * float(once.landing_y[0]))]
    told = LaunchLikelihood(observed, sling, setup).expand(
        coordinates.parameters, phi, coordinates.steps
    )
    precision = np.diag(coordinates.precision + 1e2)  # as if recordings showed each within 0.1
    moved = np.linalg.solve(precision + told.landed.hessian, told.landed.gradient)
    moved = dict(zip(coordinates.names, moved, strict=True))
    assert moved["log_returned_share"] > 0
    assert moved["log_loss_factor"] < 0
