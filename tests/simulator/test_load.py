"""The sling of a band: with the clamps that its recording showed, or without."""

from pathlib import Path

import pytest

from pipeline.params import load
from sling2sim2real.base.files import write_json
from sling2sim2real.identification.results.theta import (
    calibrated,
    launch_setup,
    load_sling,
    load_theta,
    sling_of_method,
)
from sling2sim2real.simulator import launch
from sling2sim2real.simulator.parameters import THETA, Parameters
from tests.project import DEFAULTS

PARAMS = load(DEFAULTS)
SHOWN = {"clamp_direction": [0.6, 0.0, -0.8], "flexural_rigidity": 2e-3}
VALUES = dict(zip(THETA, (2.5e5, 0.45, 3e-3, 0.7, 0.6), strict=True))


@pytest.fixture
def clamps(tmp_path: Path) -> Path:
    write_json(tmp_path / "clamps.json", SHOWN)
    return tmp_path / "clamps.json"


def mounting_of(sling) -> tuple:
    return sling.clamp_direction.tolist(), sling.flexural_rigidity


def test_a_method_takes_what_the_recording_showed_or_leaves_it_out(clamps: Path) -> None:
    method = PARAMS.methods["paper"]
    methods = {"with": method, "without": method.model_copy(update={"mounting": False})}
    params = PARAMS.model_copy(update={"methods": methods})
    assert mounting_of(sling_of_method(params, "band1", "with", clamps)) == tuple(SHOWN.values())
    as_setup = (list(PARAMS.setup.clamp_direction), None)
    assert mounting_of(sling_of_method(params, "band1", "without", clamps)) == as_setup
    assert mounting_of(load_sling(PARAMS, "band1", Path("nowhere"))) == as_setup


def test_a_theta_file_says_so_and_its_launches_land_elsewhere(clamps: Path) -> None:
    content = {"band": "band1", "theta": VALUES}
    landings, setup = [], launch_setup(PARAMS, content)
    for mounted in ({}, {"mounted": True}, {"mounted": False}):
        path = clamps.with_name("theta.json")
        write_json(path, content | mounted)
        sling = calibrated(PARAMS, "band1", load_theta(path, "band1"), clamps)
        assert (sling.flexural_rigidity is None) == (mounted == {"mounted": False})
        landings.append(
            launch(
                sling, setup, Parameters.of("neo_hookean", [*VALUES.values()]), (-0.35, -0.2)
            ).landing_y[0]
        )
    assert landings[0] == landings[1]
    assert 1e-3 < abs(landings[2] - landings[0]) < 0.5
