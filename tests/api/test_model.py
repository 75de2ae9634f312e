"""A model launches what the library launches, and θ passes through its file."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real import Band, LaunchHistory, Model, Mounting, Settings, Theta
from sling2sim2real.api.model import with_band
from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.launching.surface.simulator import simulator

DRAWS = np.array([[-0.30, -0.15], [-0.35, -0.20]])
EXTRA = {"air_drag": 0.5, "turn_damping": 0.2, "returned_share": 0.97}
HISTORY = LaunchHistory(pull_time=2.0, pause=1.0)


def test_launches_are_those_of_a_run_with_the_same_theta_file(world, tmp_path, settings) -> None:
    model = replace(
        world,
        theta=replace(world.theta, **EXTRA),
        history=HISTORY,
        mounting=Mounting(clamp_direction=(0.6, 0.0, -0.8), flexural_rigidity=2e-4),
    )
    mounting = tmp_path / "clamps.json"
    mounting.write_text(model.mounting.model_dump_json())
    content = model.theta.content("band", HISTORY)
    settings = with_band(model.settings, model.band)
    theirs = simulator(settings, "band", content, mounting)(DRAWS)
    ours = model.launches(DRAWS)
    assert np.array_equal(ours.landing_y, theirs.landing_y)
    assert not np.array_equal(world.launches(DRAWS).landing_y, ours.landing_y)


def test_launch_settings_go_before_the_recordings_history(world) -> None:
    requested = Settings.coarse(launch={"pause": 5.0})
    model = replace(world, history=HISTORY, settings=requested)
    assert model.launch_setup.history == replace(HISTORY, pause=5.0)
    assert world.launch_setup.history is None
    neo = Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6)
    assert replace(world, theta=neo, history=HISTORY).launch_setup.history is None


def test_points_of_their_own(world) -> None:
    stiff = replace(world, theta=replace(world.theta, youngs_modulus=3e5))
    both = world.launches(DRAWS, np.stack([world.theta.point, stiff.theta.point]))
    assert both.landing_y[0] == world.launches(DRAWS[0]).landing_y[0]
    assert both.landing_y[1] == stiff.launches(DRAWS[1]).landing_y[0]


@pytest.mark.parametrize(
    "law",
    [
        {},
        {"law": "corotated"},
        {
            "mooney_share": 0.2,
            "upturn": 0.1,
            "softening": 0.2,
            "relaxation": 0.01,
            "flow": 0.1,
            "log_flow_rate": 2.0,
        },
    ],
)
def test_theta_is_read_as_it_is_written(tmp_path, law) -> None:
    theta = Theta(2e5, 0.47, 2.4e-3, 0.7, 0.6, **law, **EXTRA)
    path = tmp_path / "theta.json"
    path.write_text(json.dumps(theta.content("band", HISTORY)))
    assert Theta.load(path) == theta
    assert load_theta(path, "band")["band"] == "band"
    assert Theta.of(theta.names, theta.point, theta.law) == theta
    assert replace(theta, youngs_modulus=np.float32(200000)) == theta


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"youngs_modulus": "2e5"}, "theta.youngs_modulus: must be a number"),
        ({"law": "corotated", "upturn": 0.1}, "theta: of the law corotated it must have exactly"),
        ({"law": "hookean"}, "law: must be 'neo_hookean', 'rubber' or 'corotated'"),
        ({"flow": 0.3}, "theta.log_flow_rate: must be given beside flow"),
    ],
)
def test_a_theta_that_cannot_be(values: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        replace(Theta(2e5, 0.47, 2.4e-3, 0.7, 0.6), **values)


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ((23.0, 0.010, 0.52), "Band: mass: must be between 0.0001 and 1, got 23"),
        (("23 g", 0.010, 0.52), "Band: mass: must be a number"),
    ],
)
def test_a_size_that_no_band_has_is_refused_at_once(sizes, message: str) -> None:
    with pytest.raises(UserError, match=message) as refusal:
        Band(*sizes)
    assert "\n" not in str(refusal.value)


def test_a_band_that_does_not_fit_the_lab(world) -> None:
    for wrong, message in (
        (Band(0.023, 0.010, 0.20), "rest_length"),
        (Band(0.023, 0.010, 0.52, name="my band"), "a name has at most"),
    ):
        with pytest.raises(UserError, match=message):
            Model(wrong, world.theta)
