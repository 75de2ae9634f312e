"""Force and motion of formulas: a tool that is known or measured, a hand that turns, zeros."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.events import Part, Pull
from sling2sim2real.recording.force import drift_of, estimate_tool_inertia
from sling2sim2real.recording.motion import Motion
from sling2sim2real.recording.signals import ToolFacts, signals_of
from tests.project import with_
from tests.recording.played import GRAVITY, Played, stream
from validation.recordings.bag import HAND, SENSOR, START, Truth

MASS = 0.73
TOOL = (0.01, -0.02, 0.05)  # its centre of mass


def pulled(*given) -> Pull:
    """Of a recording and its geometry, as if it were one pull."""
    return Pull.of(Part(*given))


def tool(mass: float = MASS, center=TOOL) -> SimpleNamespace:
    return SimpleNamespace(mass=mass, center=center, preconditioned=False)


def signals(played: Played, params, tool=None, recording=None, inertia=None):
    recording = recording or played.recording()
    params = with_(params, "setup", tool=tool)
    return signals_of(pulled(recording, played.geometry()), params, inertia)


def off(played: Played, result) -> np.ndarray:
    """Error of the force [N], (T,), where no kink of the truth is smeared by the low pass."""
    truth = played.truth
    t = result.time + (result.origin - START) * 1e-9
    kinks = [0.4, truth.grasp, 0.6, truth.lifted, truth.release]  # of the acceleration, too
    calm = np.all([np.abs(t - kink) > 0.06 for kink in kinks], axis=0)
    wanted = np.array([truth.force(x) for x in t])
    return np.linalg.norm(result.force - wanted, axis=1)[calm]


def band_alone(played: Played, params, inertia, recording=None):
    """Signals without the tool's inertia, which are the band's force."""
    result = signals(played, params, recording=recording, inertia=inertia)
    assert off(played, result).max() < 0.25 and np.median(off(played, result)) < 0.02
    return result


def test_a_turning_hand_asks_for_the_tool(params) -> None:
    with pytest.raises(UserError, match=r"turns by \d\d\.\d degrees .* setup.tool"):
        signals(Played(turn=0.6, mass=MASS), params)


@pytest.mark.parametrize(
    "played, given",
    [
        (Played(turn=0.6, mass=MASS), tool()),
        (Played(turn=0.6, mass=MASS, truth=Truth(sign=-1.0)), tool()),  # it feels its tool so, too
        (Played(turn=0.6, mass=MASS, fixed=True), None),  # a wrench in the base
        (Played(turn=0.6, mass=0.0), tool(mass=0.0)),  # a force without its tool
    ],
)
def test_a_turning_hand_with_its_tool_gives_the_bands_force(params, played, given) -> None:
    result = signals(played, params, given or tool(center=tuple(played.center_in_hand)))
    assert off(played, result).max() < 0.15  # of 20 N; a kink where the band goes taut
    assert np.median(off(played, result)) < 0.02
    assert result.facts.tool.mass == played.mass and np.degrees(result.facts.turn) > 10
    assert result.facts.flipped == (played.truth.sign < 0)


def test_the_inertia_of_a_hand_that_does_not_turn(params) -> None:
    """Without the tool's mass it stays in the force, with it is gone."""
    played = Played(mass=MASS, truth=Truth(noise=0.005))
    left, gone = off(played, signals(played, params)), off(played, signals(played, params, tool()))
    assert left.max() > 2.0  # the hand is lifted with several m/s^2
    assert gone.max() < 0.15 and np.median(gone) < 0.01


@pytest.mark.parametrize(("mass", "sign"), [(MASS, 1.0), (MASS, -1.0), (-0.3, 1.0)])
def test_a_tool_that_nobody_named_is_measured(params, mass, sign) -> None:
    """Its inertia in free motion is taken off the pull, too, whatever its sign."""
    played = Played(mass=mass, truth=Truth(noise=0.005, sign=sign))
    inertia = estimate_tool_inertia(pulled(played.recording(), played.geometry()), None)
    assert inertia.mass == pytest.approx(sign * mass, rel=0.03)
    result = band_alone(played, params, inertia)
    assert result.facts.tool.source == "its inertia"
    named = signals(played, params, tool(mass=0.0), inertia=inertia)
    assert named.facts.tool == ToolFacts(0.0, list(TOOL), "setup.tool")


def test_a_sensor_that_knows_the_weight_but_not_the_inertia(params) -> None:
    """The weight is not taken off a second time while the hand turns by a few degrees."""
    played = Played(turn=0.07, mass=MASS, truth=Truth(noise=0.005))
    recording = played.recording()
    t = recording.wrench.seconds(START)
    weight = (played.orientation(t) * SENSOR).inv().apply(MASS * GRAVITY)
    recording.wrench = replace(recording.wrench, values=recording.wrench.values - weight)
    inertia = estimate_tool_inertia(pulled(recording, played.geometry()), None)
    assert inertia.mass == pytest.approx(MASS, rel=0.05)
    band_alone(played, params, replace(inertia, center=TOOL), recording)


def test_a_delay_that_is_left_does_not_displace_the_inertia(params) -> None:
    """Of 20 ms, which the pose's stamps may keep by episode.delays.pose."""
    played = Played(mass=MASS, truth=Truth(noise=0.005))
    recording = played.recording()
    pose = recording.pose
    recording.pose = replace(pose, stamp=pose.stamp + 20_000_000)
    inertia = estimate_tool_inertia(pulled(recording, played.geometry()), None)
    assert inertia.delay == pytest.approx(0.02, abs=0.002)
    band_alone(played, params, inertia, recording)


class Leaving(Played):
    def orientation(self, t: np.ndarray) -> Rotation:
        """Turned by 4 degrees after the release."""
        angle = 0.07 * np.clip((t - self.truth.release - 0.05) / 0.3, 0, 1)
        return HAND * Rotation.from_rotvec(angle[:, None] * [1.0, 0.0, 0.0])


def test_the_weight_of_a_hand_that_turns_away_is_no_drift(params) -> None:
    played = Leaving(mass=MASS)
    result = signals(played, params)
    assert result.facts.drift == [0, 0, 0]
    hold = np.array(result.facts.hold_force) - played.truth.force(played.truth.release - 0.1)
    assert np.linalg.norm(hold) < 0.05


def test_gaps_are_said_and_long_ones_refused(params) -> None:
    played = Played()
    for length, topic in ((0.2, "wrench"), (0.2, "pose"), (0.4, "wrench"), (0.4, "pose")):
        recording = played.recording()
        whole = getattr(recording, topic)
        t = whole.seconds(int(whole.stamp[0]))
        keep = (t < 1.5) | (t > 1.5 + length)
        cut = replace(whole, stamp=whole.stamp[keep], values=whole.values[keep])
        setattr(recording, topic, cut)
        if length > 0.3:
            with pytest.raises(UserError, match=f"{whole.topic} is missing for 0.40 s"):
                signals(played, params, recording=recording)
        else:
            result = signals(played, params, recording=recording)
            assert result.facts.longest_gap[whole.topic] == pytest.approx(length, abs=0.005)
            hand = played.hand(result.time + (result.origin - START) * 1e-9)
            assert np.abs(result.position - hand).max() < 0.012  # a T^2 / 8, a = 2.4 m/s^2


def test_irregular_stamps_give_the_same_velocity(params) -> None:
    played = Played()
    recording = played.recording()
    even = signals(played, params, recording=recording)
    random = np.random.default_rng(3)
    u = np.sort(random.uniform(0, played.truth.end, 2000))
    u[0] = 0.0
    base = played.geometry().base.inverse()
    values = np.hstack(
        [base.apply(played.hand(u)), np.tile(recording.pose.values[0, 3:], (len(u), 1))]
    )
    recording.pose = stream("/arm/pose", u, values)
    jittered = signals(played, params, recording=recording)
    np.testing.assert_allclose(jittered.velocity, even.velocity, atol=0.03)


def test_a_stamp_of_another_century_is_refused(params) -> None:
    """And not filled in at 1 kHz."""
    for topic in ("wrench", "pose"):
        recording = Played().recording()
        whole = getattr(recording, topic)
        stamp = whole.stamp.copy()
        stamp[-1] += 3 * 10**18
        setattr(recording, topic, replace(whole, stamp=stamp))
        with pytest.raises(UserError, match=f"{whole.topic} has .* missing nearly all the time"):
            signals(Played(), params, recording=recording)


CENTER = np.zeros(3)
RELEASE, SWAY, KICK = 1.5037, 2 * np.pi * 8, 2.4  # s, rad/s and m/s^2 of an arm that is let go


def motion(t: np.ndarray, path: np.ndarray) -> Motion:
    return Motion(t, path, Rotation.identity(len(t)), float(np.median(np.diff(t))))


def swinging(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Path and acceleration (T, 3) of a hand that rests until it starts back and swings."""
    late = np.clip(t - RELEASE, 0, None)
    along = KICK / SWAY**2 * (1 - np.cos(SWAY * late))
    bent = np.where(t > RELEASE, KICK * np.cos(SWAY * late), 0.0)
    axis = np.array([0.0, 1.0, 0.1])
    return along[:, None] * axis, bent[:, None] * axis


@pytest.mark.parametrize(
    ("rate", "noise", "most"), [(1000, 2e-5, 0.5), (100, 2e-5, 0.7), (100, 1e-4, 1.1)]
)
def test_a_hand_that_starts_back(rate, noise, most) -> None:
    """Root mean square error [m/s^2] around the release: a share of the kick."""
    t = np.arange(0, 3, 1 / rate)
    path, _ = swinging(t)
    times = np.arange(RELEASE - 0.05, RELEASE + 0.05, 0.001)
    wanted, off = swinging(times)[1], []
    for seed in range(20):
        shaken = path + np.random.default_rng(seed).normal(0, noise, path.shape)
        off.append(motion(t, shaken).acceleration(times, CENTER, RELEASE) - wanted)
    assert np.sqrt(np.mean(np.sum(np.square(off), axis=-1))) < most


def test_lost_and_irregular_samples_bend_nothing() -> None:
    """Of a polynomial of the fifth degree nothing is lost, whenever it was sampled."""
    random = np.random.default_rng(1)
    t = np.sort(random.uniform(0, 3, 90))
    bends = random.normal(size=(3, 6))
    path = np.stack([np.polyval(axis, t) for axis in bends], axis=1)
    times = np.linspace(0.2, 2.8, 50)
    wanted = np.stack([np.polyval(np.polyder(axis, 2), times) for axis in bends], axis=1)
    acceleration = motion(t, path).acceleration(times, CENTER)
    np.testing.assert_allclose(acceleration, wanted, rtol=1e-5, atol=1e-3)


def test_a_hand_that_is_not_seen_rests() -> None:
    t = np.arange(0, 1, 0.01)
    hand = motion(t, 0.5 * 3.0 * t[:, None] ** 2 * [1.0, 0, 0])
    acceleration = hand.acceleration(np.array([-0.5, 0.5, 2.0]), CENTER)
    np.testing.assert_allclose(acceleration[:, 0], [0, 3, 0], atol=1e-6)


def test_too_few_samples_are_refused() -> None:
    t = np.arange(0, 0.1, 0.01)
    with pytest.raises(UserError, match="too short"):
        motion(t, np.zeros((len(t), 3))).acceleration(t, CENTER)


T = np.arange(10_000) / 1000
BIAS = np.array([3.0, -4.0, 6.0])
WAY = np.array([0.1, 0.97, -0.2])


def made(noise: float = 0.05, seed: int = 0) -> np.ndarray:
    """Grasped at 1 s, drawn from 4 to 6 s to 14 N, let go at 8 s."""
    random = np.random.default_rng(seed)
    pull = 14 * np.clip((T - 4) / 2, 0, 1) ** 0.8 * (T < 8)
    return BIAS + pull[:, None] * WAY + random.normal(0, noise, (len(T), 3))


def course(shape) -> tuple:
    force = made() + shape(T)[:, None] * WAY
    return drift_of(T, force, T < 0.95, T > 8.4, 14.0)


@pytest.mark.parametrize("size", [0.0, 0.3, 2.0, 5.0])
def test_a_steady_drift_is_known_of_any_size(size) -> None:
    drift = course(lambda t: size * t / 10)
    assert drift.steady
    np.testing.assert_allclose(10 * drift.rate, size * WAY, atol=0.02)


@pytest.mark.parametrize("size", [0.5, 1.0, 3.0])
def test_a_zero_that_warms_up_or_does_not_return_is_no_drift(size) -> None:
    """1 - exp(-t / 1.5 s), and a return error after the load."""
    for shape in (lambda t: size * (1 - np.exp(-t / 1.5)), lambda t: size * (t > 8)):
        drift = course(shape)
        assert not drift.steady and not drift.rate.any()
        assert np.linalg.norm(drift.change) == pytest.approx(size, rel=0.35)


def test_a_small_return_error_is_no_drift_either() -> None:
    """1.7 % of what was held, which would make a modulus 2 % too small."""
    assert not course(lambda t: 0.24 * (t > 8)).steady
    assert course(lambda t: 0.24 * t / 10).steady


def test_a_drift_that_the_free_hand_is_too_short_to_show_is_not_taken_out() -> None:
    """A quarter of a second at both ends tells neither a drift nor a zero that does not return."""
    for shape in (lambda t: 0.5 * t / 10, lambda t: 0.5 * (t > 8)):
        force = made() + shape(T)[:, None] * WAY
        drift = drift_of(T, force, (T > 0.7) & (T < 0.95), (T > 8.4) & (T < 8.65), 14.0)
        assert not drift.steady and not drift.rate.any()
