"""An aim lands on its target by the gentlest draw, and says what it does not know."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real import Identification, LaunchHistory, Settings, Theta, aim, launch
from sling2sim2real.base.errors import Refused, UserError
from sling2sim2real.launching.surface.stored import Stored
from tests.policy.linear import write_policy


@pytest.fixture(scope="module")
def aimed(world):
    return aim(world, 2.0)


def test_an_aim_lands_on_its_target(world, aimed) -> None:
    assert abs(launch(world, aimed.draw).landing - 2.0) < 2e-4
    assert aimed.launch == launch(world, aimed.draw)
    low, high = aimed.interval_90
    assert low < 2.0 < high


def test_no_draw_that_lands_there_takes_less_force(world, aimed) -> None:
    rng, setup = np.random.default_rng(0), world.settings.setup
    draws = np.column_stack([rng.uniform(*setup.draw_y, 4000), rng.uniform(*setup.draw_z, 4000)])
    done = world.launches(draws)
    there = np.abs(done.landing_y - 2.0) < 0.01
    assert there.sum() > 5
    assert aimed.launch.hold_force < done.hold_force[there].min() + 0.05


def test_the_interval_holds_what_samples_say(world, aimed) -> None:
    near = world.theta.point * np.ones((50, 1))
    near[:, 0] *= np.linspace(0.9, 1.1, 50)
    arguments = {name: getattr(world, name) for name in ("band", "theta", "settings")}
    sure = Identification(**arguments, samples=near[24:26], confidence={"settled": True})
    unsure = Identification(
        **arguments, samples=near, confidence={"settled": False}, stretch=1.2, stale=True
    )
    narrow, wide = (np.ptp(aim(result, 2.0).interval_90) for result in (sure, unsure))
    assert wide > 3 * narrow
    assert aim(sure, 2.0).warnings == ()
    stretch, confidence, stale = aim(unsure, 2.0).warnings
    assert "its recordings by 20.0 % at most" in str(stretch)
    assert "has not converged" in str(confidence) and "have changed since" in str(stale)
    assert [hazard.about for hazard in aimed.warnings] == ["confidence"]
    assert "no samples" in str(aimed.warnings[0])
    edge = {"settled": False, "edges": {"mooney_share": "upper"}}
    beyond = Identification(**arguments, samples=near, confidence=edge)
    assert "Mooney share is at the upper end" in str(aim(beyond, 2.0).warnings[0])
    few = Identification(
        **arguments, samples=near, confidence={"settled": True, "effective_samples": 12.0}
    )
    assert "rests on 12 samples" in str(aim(few, 2.0).warnings[0])


def test_what_the_hand_must_do_is_said(world, aimed) -> None:
    hand = LaunchHistory(pull_time=2.0, pause=1.0)
    assert aimed.pull_and_pause is None
    assert aim(replace(world, history=hand), 2.0).pull_and_pause == (2.0, 1.0)


def test_out_of_reach_is_said_with_what_is_in_reach(world) -> None:
    with pytest.raises(UserError, match=r"target 19 m: the draw for it lands .* land from \d"):
        aim(world, 19.0)
    weak = replace(world, settings=Settings.coarse(setup={"max_force": 0.5}))
    with pytest.raises(UserError, match="no draw lands; none of the box"):
        aim(weak, 2.0)


def test_a_launch_has_the_interval_of_its_draw(world) -> None:
    shot, exact = launch(world, (-0.3, -0.15)), launch(world, (-0.3, -0.15), error=0.0)
    low, high = shot.interval_90
    assert low < shot.landing < high
    assert np.ptp(exact.interval_90) < 1e-3 < high - low


def test_a_launch_that_fails_says_why(world) -> None:
    weak = replace(world, settings=Settings.coarse(setup={"max_force": 5.0}))
    strong = launch(weak, (-0.4, -0.2))
    assert "5" in strong.failure and np.isnan(strong.landing) and strong.hold_force > 5
    soft = replace(world, theta=Theta(4e3, 0.47, 2.4e-3, 0.7, 0.6))
    assert launch(soft, (-0.2, -0.1)).failure


def test_the_policy_in_a_bands_folder_is_asked(world, tmp_path) -> None:
    """One that draws along a line, whatever else lands there."""
    policy = Stored.of_band(tmp_path)
    write_policy(policy.network, (-0.05, 0.0), (-0.2, -0.15))
    put_card(policy.card_file, world.theta.content("toy")["theta"])
    arguments = {name: getattr(world, name) for name in ("band", "theta", "settings")}
    found = Identification(**arguments, policy=policy)
    answer = aim(found, 2.0, anyway=True)
    np.testing.assert_allclose(answer.draw, policy.draws(np.array([2.0]))[0])
    assert not any("another θ" in str(warning) for warning in answer.warnings)
    put_card(policy.card_file, {"youngs_modulus": 1.0})
    summary = aim(found, 2.0, anyway=True).warnings
    assert any("another θ" in str(warning) for warning in summary)
    assert abs(answer.launch.landing - 2.0) > 0.05  # which is no answer, but to those who insist
    with pytest.raises(Refused, match="lands .* off in simulation; draws of the box .* land from"):
        aim(found, 2.0)
    assert aim(found, 3.0, anyway=True).warnings[0].about == "target"


def put_card(file, theta: dict) -> None:
    card = {
        "training": {"converged": True, "mean_error_m": 0.0, "max_error_m": 0.0},
        "theta": theta,
    }
    file.write_text(json.dumps(card))


@pytest.mark.parametrize("target", ["2", float("nan"), 195, [2.0]])
def test_a_target_that_is_none_is_refused_by_its_name(world, target) -> None:
    with pytest.raises(UserError, match="target: must be a number from 0.1 to 20 m"):
        aim(world, target)


@pytest.mark.parametrize("draw", [(0.3, -0.1), (-0.3, -0.6), (-0.3,), (np.nan, -0.1), ("a", "b")])
def test_a_draw_that_is_none_is_refused_by_its_name(world, draw) -> None:
    with pytest.raises(UserError, match="draw: must be"):
        launch(world, draw)
