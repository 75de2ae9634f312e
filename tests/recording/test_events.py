"""Grasp and release of made-up signals; hands that dip; several pulls in one file."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.phases import phases
from sling2sim2real.recording import build, events, streams
from sling2sim2real.recording.build import build_episodes, episode_of, process_recording
from sling2sim2real.recording.events import (
    Part,
    Pull,
    find_grasp,
    find_release,
    find_releases,
    parts_of,
)
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.motion import Motion
from sling2sim2real.recording.streams import read_recording
from tests.project import with_
from tests.recording.conftest import part_of, pull_of, written
from tests.recording.parts import joined
from validation.recordings.bag import START, Truth, blind_bag, edit

DIRECTION, BIAS = np.array([0.3, -0.8, 0.52]), np.array([3.0, -2.0, 7.0])


def pull(
    release: float, fall: float, noise: float, seed: int, rate: float = 1000.0, start: float = 0.0
):
    """Lead-in, pull to 12 N, hold, and a fall that takes `fall` seconds."""
    t = np.arange(start, 9, 1 / rate)
    held = 12 * np.clip((t - 2) / 3, 0, 1)
    left = np.clip(1 - (t - release) / fall, 0, 1) if fall else (t < release)
    force = (held * left)[:, None] * DIRECTION / np.linalg.norm(DIRECTION) + BIAS
    return t, force + np.random.default_rng(seed).normal(0, noise, force.shape)


@pytest.mark.parametrize("rate", [200.0, 500.0, 1000.0, 2000.0])
@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_release_between_samples_is_unbiased_and_its_error_is_true(rate, noise) -> None:
    """Random phases between samples, falls of 0 to 6 ms, dropped samples."""
    random = np.random.default_rng(5)
    off, error, resolution = [], [], []
    for seed in range(40):
        release = 7.5 + random.uniform(0, 7 / rate)
        fall = random.choice([0.0, random.uniform(0, 6e-3)])
        t, force = pull(release, fall, noise, seed, rate, start=5.0)
        retained = random.random(len(t)) >= 0.02
        event = find_release(t[retained], force[retained])
        off.append(event.time - release)
        error.append(event.error)
        resolution.append(event.resolution)
    off, error = np.array(off), np.array(error)
    period = max(1 / rate, 5e-4)
    assert np.percentile(np.abs(off), 95) <= 0.7 * period
    assert abs(off.mean()) <= 0.2 * period
    assert 0.6 < np.sqrt(np.mean((off / np.maximum(error, 2e-5)) ** 2)) < 1.7
    assert np.all(error <= np.array(resolution))


def test_a_fall_within_one_sample_is_put_between_the_two() -> None:
    """The last held and the first fallen sample bound it; neither is more likely."""
    t, force = pull(7.5003, 0.0, 0.02, 1)
    event = find_release(t, force)
    assert 7.5002 < event.time < 7.5007
    assert event.error == pytest.approx(1e-3 / np.sqrt(12), rel=0.15)


def rings(t: np.ndarray, force: np.ndarray) -> None:
    force[:, 1] += 1.5 * np.exp(-(((t - 4.0) / 0.05) ** 2))  # and a bump before
    late = np.maximum(t - 7.5, 0)
    force += (np.exp(-late / 0.01) * np.sin(900 * late))[:, None]


def knocked(t: np.ndarray, force: np.ndarray) -> None:
    force[(t > 0.6) & (t < 0.62)] += [0.0, 40.0, 0.0]


def slips(t: np.ndarray, force: np.ndarray) -> None:
    """The band slides through the fingers, which costs more than what is left to let go."""
    force[t >= 5.5] = BIAS + 0.4 * (force[t >= 5.5] - BIAS)


def caught_again(t: np.ndarray, force: np.ndarray) -> None:
    force[t >= 4.0] = BIAS
    force[t > 5.5] = pull(7.5, 0.0, 0.03, 4)[1][t > 5.5]


@pytest.mark.parametrize(
    ("spoil", "missing", "found"),
    [
        (rings, (9.0, 9.0), []),
        (knocked, (9.0, 9.0), []),
        (slips, (9.0, 9.0), [5.5]),
        (rings, (6.0, 6.5), []),
        (rings, (7.48, 7.51), "missing for 3[0-9] ms around the release"),
        (caught_again, (9.0, 9.0), r"let go at 4\.0 and 7\.5 s"),
    ],
)
def test_what_comes_before_does_not_move_the_release(spoil, missing, found) -> None:
    """Slips are told; a gap there, and two releases that no fingers tell apart, are refused."""
    t, force = pull(7.5, 0.0, 0.03, 3)
    spoil(t, force)
    kept = (t < missing[0]) | (t > missing[1])
    if isinstance(found, str):
        with pytest.raises(UserError, match=found):
            find_release(t[kept], force[kept])
        fingers = gripper(1.0, 7.53)
        assert spoil is rings or abs(find_release(t, force, fingers).time - 7.5) <= 1e-3
        return
    event = find_release(t[kept], force[kept])
    assert abs(event.time - 7.5) <= 1e-3
    assert event.drop == pytest.approx(12 * (0.4 if found else 1), rel=0.03)
    np.testing.assert_allclose(event.slips, found, atol=0.01)


def test_no_release() -> None:
    with pytest.raises(UserError, match="no release"):
        find_release(*pull(20.0, 0.0, 0.03, 1))


def resting(t: np.ndarray, path: np.ndarray | float = 0.0) -> Motion:
    path = path + np.zeros((len(t), 3))
    return Motion(t, path, Rotation.identity(len(t)), float(np.median(np.diff(t))))


def lifted(at: float) -> Motion:
    """Down to the band from 10 cm above, and from `at` on up at 0.2 m/s for a second."""
    t = np.arange(0, 9, 0.01)
    up = 0.1 * np.clip(0.5 - t, 0, 0.5) + 0.2 * np.clip(t - at, 0, 1)
    return resting(t, up[:, None] * [0, 0, 1])


def gripper(closes: float, opens: float, begins: float = 0.0, once: float = 9.0):
    """Times, and openings that are closed once before for 0.3 s."""
    t = np.arange(begins, 9, 0.02)
    closed = ((t >= closes) & (t < opens)) | ((t > once) & (t < once + 0.3))
    return t, np.where(closed, 0.016, 0.08)


STILL = resting(np.arange(0, 9, 0.02))


@pytest.mark.parametrize(
    ("fingers", "motion", "grasp"),
    [
        (gripper(1.0, 7.53), STILL, 1.0),
        (gripper(1.5, 7.53, once=0.5), STILL, 1.5),
        (None, lifted(1.0), 1.03),
        (gripper(1.3, 7.83), lifted(1.02), 1.02),  # late by 0.3 s: not into the lift
        (gripper(0.0, 7.53, begins=3.0), lifted(1.0), 1.03),  # begins after the grasp
        (None, STILL, "no grasp"),
        (gripper(1.0, 99.0), STILL, "stays closed"),
    ],
)
def test_the_grasp_by_the_fingers_or_by_the_lift(fingers, motion, grasp) -> None:
    if isinstance(grasp, str):
        with pytest.raises(UserError, match=grasp):
            find_grasp(fingers, motion, 7.5)
    else:
        assert find_grasp(fingers, motion, 7.5) == pytest.approx(grasp, abs=0.03)


UNITS = {"m": 0.08, "mm": 80.0, "percent": 100.0, "knuckle": -0.8, "steps": -255.0}


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("lead", [0.0, 0.7])  # closed at first, then opened around the band
def test_grasp_by_a_gripper_of_any_sign_and_unit(unit, lead) -> None:
    t, force = pull(7.5, 0.002, 0.02, 3)
    times = np.arange(0, 9, 0.02)
    open_ = np.interp(times, [lead, lead + 0.1, 1.2, 1.4, 7.5, 7.7], [lead == 0, 1, 1, 0.1, 0.1, 1])
    noise = np.random.default_rng(4).normal(0, 1e-3, len(times))
    fingers = times, UNITS[unit] * (open_ + noise) + (0.8 if UNITS[unit] < 0 else 0)
    release = find_release(t, force, fingers).time
    assert find_grasp(fingers, resting(t), release) == pytest.approx(1.38, abs=0.05)
    assert find_releases(t, force, fingers) == pytest.approx([7.5], abs=0.01)
    slipped = times, np.where(times > 7, fingers[1][340] - 0.05 * UNITS[unit], fingers[1])
    with pytest.raises(UserError, match="the gripper stays closed"):
        find_grasp(slipped, resting(t), release)


KNOTS = {
    "dip": ((1.0, 0.0), (2.2, 0.38), (2.7, 0.28), (3.2, 0.38), (4.3, 0.38)),
    "fast": ((1.0, 0.0), (2.2, 0.38), (2.45, 0.28), (2.7, 0.38), (3.2, 0.38)),
    "cycles": (
        (1.0, 0.0), (1.8, 0.38), (2.6, 0.0), (3.4, 0.38), (4.2, 0.0), (5.2, 0.38), (6.4, 0.38)
    ),
}  # fmt: skip
EXPECTED = {
    "dip": "loading unloading reloading pause recoil swing",
    "fast": "loading unloading reloading pause recoil swing",
    "cycles": "loading unloading reloading unloading reloading pause recoil swing",
}
ASIDE = {"rate", "pause"}  # as the recordings are made


@dataclass(frozen=True)
class Led(Truth):
    """The hand goes from knot to knot of time and drawn distance, and lets go at the last."""

    draw: float = 0.0
    knots: tuple[tuple[float, float], ...] = ()

    def hand(self, t: float) -> np.ndarray:
        way = 0.0
        for (begin, low), (end, high) in zip(self.knots[:-1], self.knots[1:], strict=True):
            part = min(max((t - begin) / (end - begin), 0.0), 1.0)
            way += (high - low) * part**2 * (3 - 2 * part)
        return super().hand(t) - [0.0, way, 0.0]


def led(name: str) -> Led:
    release = KNOTS[name][-1][0] + 4e-4
    return Led(knots=KNOTS[name], drawn=KNOTS[name][-2][0], release=release, end=release + 1.2)


LONG = pytest.param("cycles", marks=pytest.mark.slow)


@pytest.fixture(scope="session", params=["dip", "fast", LONG])
def done(request, params, tmp_path_factory):
    """(name, truth, the one pull that is in it); to be read only."""
    path, truth = written(tmp_path_factory, f"{request.param}.mcap", truth=led(request.param))
    usable, refused = process_recording(path, params.bands["band1"], params)
    assert not refused
    (pull,) = usable
    return request.param, truth, pull


def test_no_check_takes_a_dip_for_a_fault(done) -> None:
    findings = [
        finding for finding in done[2].findings if "it swings" not in finding.what
    ]  # as it is made
    assert {finding.about for finding in findings} <= ASIDE


def test_it_is_one_pull_whose_events_are_found(done) -> None:
    _, truth, pull = done
    signals = pull.signals
    assert pull.whole.start + signals.release_time == pytest.approx(truth.release, abs=1e-3)
    assert pull.whole.start + signals.grasp_time == pytest.approx(truth.grasp, abs=0.021)
    assert not signals.facts.slips


def test_the_window_follows_the_interaction(done, params) -> None:
    name, truth, pull = done
    signals, usual = pull.signals, params.episode
    period = usual.duration / usual.samples
    assert np.diff(signals.time) == pytest.approx(period)
    needed = truth.release + usual.tail - truth.grasp
    if name == "fast":
        assert len(signals.time) == usual.samples
    else:
        assert usual.samples < len(signals.time) <= (needed + 0.5) / period + 2
    assert len(pull.view.times) == pytest.approx(15 * signals.duration, abs=2)
    episode = episode_of(pull, "band1")
    assert [phase.kind for phase in phases(episode)] == EXPECTED[name].split()
    hand = np.array([truth.hand(pull.whole.start + time) for time in episode.time])
    np.testing.assert_allclose(episode.position, hand, atol=1e-3)


def test_beyond_the_longest_it_is_refused_in_one_line(done, params) -> None:
    short = with_(params, "episode", longest=3.6, duration=3.6, samples=120, tail=0.5)
    path = done[2].part.recording.path
    if done[0] == "fast":
        return
    with pytest.raises(UserError, match=r"more than episode.longest 3.6 s .* fewer cycles"):
        process_recording(path, short.bands["band1"], short)


@pytest.mark.parametrize("leg", [0.1, 0.15, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("depth", [0.05, 0.1, 0.2])
def test_no_dip_that_an_arm_can_do_is_a_release(leg, depth) -> None:
    """Down to 0.1 s each way, which takes 60 m/s^2 for 10 cm."""
    low, again = 3.0 + leg, 3.0 + 2 * leg
    knots = (
        (1.0, 0.0),
        (2.5, 0.38),
        (3.0, 0.38),
        (low, 0.38 - depth),
        (again, 0.38),
        (again + 1, 0.38),
    )
    truth = Led(knots=knots, release=again + 1)
    time = np.arange(0, truth.release + 1, 1e-3)
    force = np.array([truth.force(t) for t in time])
    force += np.random.default_rng(0).normal(0, 0.04, force.shape)
    release = find_release(time, force)
    assert release.time == pytest.approx(truth.release, abs=2e-3)
    assert len(find_releases(time, force, None)) == 1


DEEP, SHALLOW = Truth(), Truth(draw=0.26, release=3.1507)


@pytest.fixture(scope="module")
def seen_again(tmp_path_factory):
    """(path, truth) of a shallower pull, with other noise of the clocks."""
    return written(tmp_path_factory, "shallow.mcap", truth=SHALLOW)


@pytest.fixture(scope="module")
def both(seen, seen_again, tmp_path_factory):
    """(path, shifts) of both in one file."""
    path = tmp_path_factory.mktemp("pulls") / "both.mcap"
    return path, joined(path, [seen[0], seen_again[0]])


def test_each_pull_is_as_its_truth_and_as_in_a_file_of_its_own(
    both, seen, seen_again, episode, params
) -> None:
    path, shifts = both
    together, refused = build_episodes(path, "band1", params)
    singles = episode, build_episodes(seen_again[0], "band1", params)[0][0]
    truths = seen[1], seen_again[1]
    assert [result.metadata["input"]["pull"] for result in together] == [1, 2] and not refused
    for episode, single, truth, shift in zip(together, singles, truths, shifts, strict=True):
        assert episode.metadata["input"]["file"] == path.name
        start = (episode.metadata["input"]["start_ns"] - START) * 1e-9 - shift  # of the window
        assert start + episode.release_time == pytest.approx(truth.release, abs=1e-3)
        assert start + episode.grasp_time == pytest.approx(truth.grasp, abs=0.021)
        time = start + episode.time
        calm = (np.abs(time - truth.release) > 0.06) & (time > 0.1)
        force = np.array([truth.force(t) for t in time])
        np.testing.assert_allclose(episode.force[calm], force[calm], atol=0.15)
        before = (single.metadata["input"]["start_ns"] - START) * 1e-9
        assert start + episode.release_time == pytest.approx(before + single.release_time, abs=2e-5)
        stamps = start + episode.cloud_time
        shared = [np.abs(before + single.cloud_time - stamp).min() < 1e-6 for stamp in stamps]
        assert np.mean(shared) > 0.95  # the same pictures


def test_a_shallow_pull_beside_a_deep_one_is_no_slip(both, params) -> None:
    """The fingers open, and the hand is free. Between the two it serves both."""
    whole = part_of(read_recording(both[0], params.setup), params)
    recording = whole.recording
    pulls = [Pull.of(part) for part in parts_of(recording, whole.geometry)]
    wanted = [DEEP.release, SHALLOW.release + both[1][1]]
    np.testing.assert_allclose([pull.release.time for pull in pulls], wanted, atol=0.01)
    assert [(pull.number, pull.count) for pull in pulls] == [(1, 2), (2, 2)]
    assert {pull.recording.origin for pull in pulls} == {recording.origin}
    first, second = ([pull.force_time[k] for k in (0, -1)] for pull in pulls)
    assert first[0] == 0 and second[1] == recording.wrench.seconds(recording.origin)[-1]
    assert DEEP.release < second[0] < first[1] < both[1][1] + SHALLOW.grasp  # they share it


def test_what_holds_one_pull_or_is_not_understood_stays_whole(blind, params) -> None:
    recording = read_recording(blind[0], params.setup)
    whole = part_of(recording, params)
    assert parts_of(recording, whole.geometry) == [whole]
    assert recording.origin == recording.wrench.stamp[0]
    still = replace(recording.wrench, values=0 * recording.wrench.values)
    still = replace(recording, wrench=still)
    assert parts_of(still, whole.geometry) == [Part(still, whole.geometry)]


def test_a_pull_that_cannot_be_used_is_named_and_the_others_are_used(
    both, seen, tmp_path, params
) -> None:
    """The second one's pictures are black."""
    path = tmp_path / "half.mcap"
    joined(path, [seen[0], blind_bag(tmp_path, SHALLOW)])
    results, refused = process_recording(path, params.bands["band1"], params)
    assert [done.part.number for done in results] == [1]
    (line,) = map(str, refused)
    assert line.startswith(f"{path}: pull 2 of 2: ") and "empty mask" in line and "\n" not in line


def test_a_band_that_slips_out_between_two_pulls_is_a_pull_that_cannot_be_used(
    seen, checked, tmp_path, params
) -> None:
    """Else the force of that pull would be the tare of the next one."""

    def stay(stamp: int, message) -> None:
        late = (stamp - START) * 1e-9 > 0.5
        message.position = [0.008 if late else 0.04] * 2

    path = tmp_path / "slipped.mcap"
    closed = blind_bag(tmp_path, change=edit(gripper=stay))
    joined(path, [seen[0], closed, seen[0]])
    results, refused = process_recording(path, params.bands["band1"], params)
    assert [done.part.number for done in results] == [1, 3]
    assert "pull 2 of 3: the force drops at" in str(refused[0])
    assert "gripper stays closed" in str(refused[0])
    alone = checked.signals.facts.bias
    for done in results:
        np.testing.assert_allclose(done.signals.facts.bias, alone, atol=0.02)


def test_a_force_that_fails_for_a_while_does_not_end_a_pull(seen, params) -> None:
    """The fingers stay closed, and nothing is grasped anew."""
    recording = read_recording(seen[0], params.setup)
    time = recording.wrench.seconds(recording.origin)
    force = recording.wrench.values.copy()
    force[(time > 2.4) & (time < 2.75)] = force[0]
    failed = replace(recording, wrench=replace(recording.wrench, values=force))
    assert len(parts_of(failed, geometry_of(failed, params.setup))) == 1
    assert pull_of(failed, params).release.time == pytest.approx(DEEP.release, abs=0.05)


def test_where_none_can_be_used_the_first_says_why(blind, tmp_path, params) -> None:
    path = tmp_path / "black.mcap"
    joined(path, [blind[0], blind[0]])
    with pytest.raises(UserError, match=r"black.mcap: pull 1 of 2: .*empty mask"):
        process_recording(path, params.bands["band1"], params)


@pytest.mark.parametrize("delay", [None, 0.001])
def test_one_recording_is_read_and_understood_once(seen, params, monkeypatch, delay) -> None:
    """Also where a delay was given, which is taken off as the file is read."""
    calls: Counter[str] = Counter()

    def count(module, name: str) -> None:
        real = getattr(module, name)
        monkeypatch.setattr(
            module, name, lambda *given, **named: (calls.update([name]), real(*given, **named))[1]
        )

    for module, names in (
        (streams, ["read_container"]),
        (build, ["geometry_of"]),
        (Motion, ["of"]),
        (events, ["find_releases", "find_release", "find_grasp"]),
    ):
        for name in names:
            count(module, name)
    build_episodes(seen[0], "band1", with_(params, "episode.delays", pose=delay, camera=None))
    assert len(calls) == 6 and {*calls.values()} == {1}
