"""Against a slingshot with a closed form: where its landing depends least on the draw."""

import numpy as np
import pytest
from scipy.optimize import brentq

from rig.oracle.aim import hit, least_sensitive_draw, sensitivity
from sling2sim2real.launching.surface.aim import INSET, NEAR
from sling2sim2real.launching.surface.landing_map import LandingMap
from tests.policy import toy

TARGETS = (1.725, 1.925, 2.125)


def land(draw: np.ndarray) -> float:
    return float(toy.launch(np.atleast_2d(draw)).landing_y[0])


def steepness(draw: np.ndarray) -> float:
    step = 1e-6
    return float(
        np.hypot(*[(land(draw + e) - land(draw - e)) / (2 * step) for e in step * np.eye(2)])
    )


@pytest.fixture(scope="module", params=[np.inf, 15.0])
def landing_map(request) -> LandingMap:
    """As coarse as the rig's; with a force limit that cuts the box, and without."""
    box = {"draw_y": toy.DRAW_Y, "draw_z": toy.DRAW_Z, "max_force": request.param}
    return LandingMap.simulate(toy.launch, **box, size=(9, 7))


def best_of_the_box(target: float, max_force: float) -> float:
    """Least steepness among exact hits on ten thousand lines through the fork."""
    candidates = []
    for slope in np.linspace(toy.DRAW_Z[1] / toy.DRAW_Y[0], toy.DRAW_Z[0] / toy.DRAW_Y[1], 2000):
        reach = [
            max(toy.DRAW_Y[0], toy.DRAW_Z[0] / slope),
            min(toy.DRAW_Y[1], toy.DRAW_Z[1] / slope),
        ]
        ends = [np.array([y, slope * y]) for y in reach]
        if (land(ends[0]) - target) * (land(ends[1]) - target) > 0:
            continue
        y = brentq(lambda y, slope=slope: land(np.array([y, slope * y])) - target, *reach)
        draw = np.array([y, slope * y])
        if toy.launch(draw[None]).hold_force[0] <= max_force:
            candidates.append(steepness(draw))
    return min(candidates)


@pytest.mark.parametrize("target", TARGETS)
def test_no_draw_of_the_box_that_hits_is_less_sensitive(landing_map, target: float) -> None:
    draw = least_sensitive_draw(landing_map, target)
    assert abs(land(draw) - target) < 0.02  # half a millimetre of draw, and the map's own error
    assert np.isclose(steepness(draw), best_of_the_box(target, landing_map.max_force), rtol=0.02)
    assert np.isclose(sensitivity(landing_map, draw[None])[0], steepness(draw), rtol=0.02)
    low, high = np.array([toy.DRAW_Y, toy.DRAW_Z]).T
    assert ((draw >= low + INSET) & (draw <= high - INSET)).all()
    assert toy.launch(draw[None]).hold_force[0] <= landing_map.max_force * 1.001


@pytest.mark.parametrize("target", TARGETS)
def test_the_root_search_hits(target: float) -> None:
    """In a few launches, from a start that is 10 cm off, along its line."""
    launched = []

    def counted(draw: np.ndarray) -> float:
        launched.append(draw)
        return land(draw)

    start = np.array([-0.36, -0.17])
    start *= brentq(lambda scale: land(scale * start) - target - 0.1, 0.5, 1.5)
    draw = hit(counted, target, start)
    assert abs(land(draw) - target) <= NEAR
    assert np.isclose(draw[1] / draw[0], start[1] / start[0])
    assert len(launched) <= 5


def test_what_cannot_be_hit_has_no_draw(landing_map) -> None:
    assert np.isnan(least_sensitive_draw(landing_map, 99.0)).all()
    start = np.array([-0.3, -0.2])
    assert np.isnan(hit(lambda draw: float("nan"), 1.9, start)).all()
    launches = []
    stuck = hit(lambda draw: launches.append(draw) or 1.0, 1.9, start)  # it never lands further
    assert np.isnan(stuck).all() and 0 < len(launches) < 20
