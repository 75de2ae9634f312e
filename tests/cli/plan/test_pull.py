"""The catenary against its length, and the phases of any plan that params.yaml allows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from pipeline.params import load
from sling2sim2real.cli.plan.pull import SPARE, TICK, catenary_sag, hanging_middle, trajectory_of
from sling2sim2real.episode.planned import leg_time
from sling2sim2real.episode.window import LEAD
from sling2sim2real.recording.events import CALM
from sling2sim2real.settings import PlanParams
from tests.project import DEFAULTS, with_

PARAMS = with_(load(DEFAULTS), "plan", dips=())
AHEAD = np.array([0.0, 1.0, 0.0])


@given(width=st.floats(0.02, 2), ratio=st.floats(1.001, 50))
def test_the_catenary_of_that_sag_has_that_length(width, ratio) -> None:
    """z = a cosh(x / a), a from the sag alone, integrated along the curve."""
    sag = catenary_sag(ratio * width, width)
    half = width / 2
    u = brentq(lambda u: half / u * (np.cosh(u) - 1) - sag, 1e-6, 300, xtol=1e-14)
    length = 2 * quad(lambda x: np.cosh(u * x / half), 0, half, epsrel=1e-10)[0]
    assert length == pytest.approx(ratio * width, rel=1e-5)


def test_the_catenary_at_its_ends() -> None:
    """Nearly taut it is a parabola, sag^2 = 3/8 w (L - w); deep it is two vertical halves."""
    assert catenary_sag(1.0 + 1e-6, 1.0) == pytest.approx(np.sqrt(3 / 8 * 1e-6), rel=1e-4)
    assert catenary_sag(1.0 + 1e-12, 1.0) == pytest.approx(np.sqrt(3 / 8 * 1e-12), rel=1e-3)
    assert catenary_sag(3.0, 1e-4) == pytest.approx(1.5, rel=1e-3)
    with pytest.raises(ValueError, match="does not reach"):
        catenary_sag(0.2, 0.2)


def test_the_default_is_the_pull_that_the_method_was_made_with() -> None:
    """About 1 s to lift, 4 s to pull by 0.40 m, 2 s of pause."""
    plan = trajectory_of(PARAMS.plan, PARAMS.setup, PARAMS.episode, PARAMS.bands["band1"], AHEAD)
    lasts = {phase.name: phase.duration for phase in plan.phases}
    assert lasts["lift"] == pytest.approx(1.0, abs=0.05)
    assert (lasts["pull"], lasts["pause"]) == (pytest.approx(4.0), 2.0)
    assert lasts["lead-in"] >= 0.5


def test_plan_hanging_comes_before_the_catenary() -> None:
    measured = with_(PARAMS.plan, "", hanging=0.19)
    middle = hanging_middle(measured, PARAMS.setup, PARAMS.bands["band1"])
    np.testing.assert_array_equal(middle, [0, 0, -0.19])
    string = hanging_middle(PARAMS.plan, PARAMS.setup, PARAMS.bands["band1"])
    assert string[2] == -catenary_sag(0.52, 0.275)


def number(low: float, high: float):
    return st.floats(low, high)


def whole(content: dict) -> dict:
    """With a pull no faster than the hand, and its dips within speed, acceleration and range."""
    dips, size = [], float(np.linalg.norm(content["draw"]))
    for at, part, slower in content["dips"]:
        depth = part * at * size
        time = slower * leg_time(depth, content["max_speed"], content["max_acceleration"])
        if depth >= 0.01 and depth <= 1 and 0.05 <= time <= 20:
            dips.append({"at": at, "depth": depth, "out_time": time, "back_time": time})
    return {**content, "dips": dips, "pull_speed": min(content["pull_speed"], content["max_speed"])}


PLANS = st.fixed_dictionaries(
    {
        "draw": st.lists(number(-2, -0.05), min_size=1, max_size=1).flatmap(
            lambda y: number(-2, 1).map(lambda z: [y[0], z])
        ),
        "dips": st.lists(
            st.tuples(number(0.1, 1) | st.just(1.0), number(0.05, 0.95), number(1, 5)), max_size=3
        ),
        "max_speed": number(0.005, 3),
        "pull_speed": number(0.005, 3),
        "max_acceleration": number(0.05, 30),
        "lead_in": number(0.5, 60),
        "finger_time": number(0.05, 10),
        "pause": number(0.5, 60),
        "wait": number(0, 60),
        "approach": number(0, 0.5),
        "retreat": number(0, 0.5),
        "floor_clearance": number(0, 0.5),
        "hanging": st.none() | number(0, 3),
        "gripper": st.just({"open": 0.08, "closed": 0.0, "position": "finger"}),
        "orientation": st.none(),
        "frame": st.just("base"),
    }
).map(whole)


@given(content=PLANS, pulls=st.integers(1, 3), duration=number(1, 120), share=number(0.01, 0.9))
def test_each_of_several_pulls_is_the_first_again_and_finds_the_band_calm(
    content, pulls, duration, share
) -> None:
    """What the next pull's window shows begins when the last swing is over."""
    plan = PlanParams.model_validate(content)
    episode = with_(PARAMS.episode, "", duration=duration, tail=share * duration)
    rest = PARAMS.setup, episode, PARAMS.bands["band1"], AHEAD
    single, way = (trajectory_of(plan, *rest, count) for count in (1, pulls))
    np.testing.assert_array_equal(way.times[: len(single.times)], single.times)
    starts = dict.fromkeys(("lead-in", "grasp", "pause", "release"), ())
    for phase, start in zip(way.phases, way.times, strict=False):
        if phase.name in starts:
            starts[phase.name] += (start,)
    assert {len(times) for times in starts.values()} == {pulls}
    lead, grasp, pause, release = map(np.array, starts.values())
    np.testing.assert_allclose(release - pause, release[0] - pause[0], atol=1e-6)
    held = (release - grasp)[1:]
    np.testing.assert_allclose(held, release[0] - grasp[0], atol=1e-6)
    calm = release[1:] + episode.tail - episode.duration - release[:-1]
    calm = np.minimum(calm, grasp[1:] - LEAD - release[:-1])
    assert np.all(calm >= CALM - TICK) and np.all(lead[1:] + plan.lead_in <= grasp[1:] + TICK)
    for begin in lead:
        np.testing.assert_allclose(way.position(begin), way.position(0.0), atol=1e-9)


@given(content=PLANS, angle=number(-1.5, 1.5), duration=number(1, 120), share=number(0.01, 0.9))
def test_any_plan_rests_in_time_and_within_its_limits(content, angle, duration, share) -> None:
    plan = PlanParams.model_validate(content)
    episode = with_(PARAMS.episode, "", duration=duration, tail=share * duration)
    axis = np.array([0.0, np.cos(angle), np.sin(angle)])
    way = trajectory_of(plan, PARAMS.setup, episode, PARAMS.bands["band1"], axis)
    names = [phase.name for phase in way.phases]
    pulling = np.array([name == "pull" for name in names])
    speeds = way.peaks(1)
    assert speeds[pulling].max() <= plan.pull_speed * (1 + 1e-6)
    assert speeds[~pulling].max() <= plan.max_speed * (1 + 1e-6)
    assert way.peaks(2).max() <= plan.max_acceleration * (1 + 1e-6)
    ticks = way.times / TICK
    np.testing.assert_allclose(ticks, np.round(ticks), atol=1e-6)

    grasp, release = way.start_of("grasp"), way.start_of("release")
    rest = np.linalg.norm(way.position(np.linspace(0, plan.lead_in, 5), 1), axis=1)
    assert rest.max() < 1e-9 and grasp >= plan.lead_in - 1e-6
    np.testing.assert_allclose(way.position(release), [0.0, *plan.draw], atol=1e-12)
    still = np.linspace(release, release + episode.tail, 5)
    np.testing.assert_allclose(way.position(still), [[0.0, *plan.draw]] * 5, atol=1e-12)
    assert way.duration >= max(episode.duration, release + episode.tail) + SPARE - 2 * TICK
    held = way.opening(np.linspace(grasp + plan.finger_time + TICK, release, 9))
    np.testing.assert_allclose(held, 0.0, atol=1e-9)
    assert way.opening(0.0) == way.opening(way.duration) == 0.08
