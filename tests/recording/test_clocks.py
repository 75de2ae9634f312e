"""Clocks, bursts and held values that were put in are mended, refused or said."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import pace
from sling2sim2real.recording.checks import of_topics
from sling2sim2real.recording.delays import correct_delays
from sling2sim2real.recording.messages import NO_SCHEMA, Reading, Topic
from sling2sim2real.recording.streams import Recording, Stream, drift_of, read_recording, streams_of
from sling2sim2real.recording.topics import Choice
from tests.project import with_
from tests.recording.conftest import part_of, pull_of
from validation.recordings.bag import START, Truth, blind_bag, edit, head

MS = 1_000_000
Changes = Mapping[int, dict]
LONG = Truth(end=7.0)


def topic(
    rate: float, seconds: float = 6.0, *, seed: int = 0, jitter: float = 0.02, delay: float = 3e-4
) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and log_times [ns]: an even rate, exponential delays."""
    random = np.random.default_rng(seed)
    k = np.arange(int(seconds * rate))
    stamp = START + np.round(1e9 * (k + jitter * random.normal(size=len(k))) / rate).astype(int)
    late = delay + random.exponential(delay, len(k))
    # The recorder writes as it receives.
    return stamp, np.maximum.accumulate(stamp + np.round(1e9 * late).astype(int))


def stream_of(stamp: np.ndarray, log: np.ndarray, changes: Changes | None = None) -> Stream:
    """A topic whose values are its messages' numbers, of which some are changed."""
    readings = [Reading(int(time), "", (float(k), 0.0, 0.0)) for k, time in enumerate(stamp)]
    for k, change in (changes or {}).items():
        readings[k] = readings[k]._replace(**change)
    choice = Choice(Topic("/x", NO_SCHEMA, ""), [*zip(log.tolist(), readings, strict=True)])
    return streams_of({"wrench": choice})[0]["wrench"]


def test_chunks_in_another_order_are_refused() -> None:
    stamp, log = topic(1000.0, seed=7)
    order = np.r_[0:1000, 3000:4000, 2000:3000, 1000:2000, 4000:6000]
    with pytest.raises(UserError, match=r"go back by 1\.999 s after 3\.00 s: .* `mcap sort` it"):
        stream_of(stamp[order], log[order])


FAR = {0: -36, 1: 5, 100: 10**6, 500: -(10**9), 501: 5, 999: 3600}  # s, the first two and the last


@pytest.mark.parametrize(
    ("changes", "note"),
    [
        ({100: {"value": (np.nan, 0.0, 0.0)}}, "lost 1 not finite"),
        ({100: {"value": (5000.0, 0.0, 0.0)}}, "lost 1 far off those around"),
        ({k: {"value": (k + 60.0, 0.0, 0.0)} for k in range(100, 108)}, ""),  # a knock
        ({100: {"frame": "other"}}, "lost 1 in another frame"),
        ({100: {"stamp": 0}}, "lost 1 without a stamp"),
        ({100: {"stamp": START + 99 * MS}}, "lost 1 with the stamp of another"),
        ({k: {"stamp": START + (k + s * 1000) * MS} for k, s in FAR.items()}, "far off in time"),
        ({100: {"stamp": START + 101 * MS}, 101: {"stamp": START + 100 * MS}}, ""),  # sorted
    ],
)
def test_what_is_left_out_is_said(changes, note) -> None:
    """Other messages stay as they are."""
    stream = stream_of(*topic(1000.0, 1.0, jitter=0.0), changes)
    left_out = {*changes} if "lost" in note or "far" in note else set()
    assert stream.notes == ([stream.notes[0]] if note else []) and note in "".join(stream.notes)
    assert stream.lost == len(left_out) and np.all(np.diff(stream.stamp) > 0)
    others = {*range(1000)} - {*changes}
    assert others <= {*stream.values[:, 0]} and not left_out & {*stream.values[:, 0]}


def test_a_topic_without_stamps_is_refused() -> None:
    with pytest.raises(UserError, match="/x has no header stamps"):
        stream_of(np.zeros(50, int), topic(50.0, 1.0)[1])


@pytest.mark.parametrize(
    ("rate", "step"), [(0, 0), (-3e-3, 0), (5e-4, 0), (0, -0.06), (0, 0.005), (0, 0.06)]
)
def test_a_drift_or_a_step_is_told_by_the_least_delays(rate, step) -> None:
    """Of a drift most: the first part's mean is compared with the last one's."""
    whole = 9 * rate + step
    for seed in range(5):
        stamp, log = topic(1000.0, 9.0, seed=seed)
        odd = START + np.round((stamp - START) * (1 + rate)).astype(np.int64)
        odd[4000:] += round(1e9 * step)
        force, received = topic(1000.0, 9.0, seed=seed + 10)
        topics = SimpleNamespace(stamp=odd), log, SimpleNamespace(stamp=force), received
        change, error = drift_of(*topics)
        assert abs(change - whole) < 0.2 * abs(whole) + 2e-4
        assert not whole or abs(change) > 4 * error
    short = SimpleNamespace(stamp=odd[:1000]), log[:1000], *topics[2:]
    assert drift_of(*short) == (0.0, np.inf)


def read(folder, params, **options) -> Recording:
    return read_recording(blind_bag(folder, **options), params.setup)


def shift(*kinds: str, by: float, since: float = -1.0, until: float = 1e9):
    """A `change` for write_bag: these topics' stamps, between two times, by so many seconds."""

    def moved(stamp: int, message) -> None:
        if since <= (stamp - START) * 1e-9 < until:
            message.header = head(stamp + round(by * 1e9), message.header.frame_id)

    return edit(**dict.fromkeys(kinds, moved))


@pytest.fixture(scope="module")
def good(tmp_path_factory, params) -> Recording:
    return read(tmp_path_factory.mktemp("clock"), params)


def test_a_gripper_on_another_clock_is_left_out(tmp_path, params, good) -> None:
    """The grasp is then read from the lift. Nothing is said of a good file."""
    assert good.losses == [] and all(stream.notes == [] for stream in good.streams.values())
    recording = read(tmp_path, params, change=shift("gripper", by=-3600.0))
    assert recording.gripper is None and recording.losses == []
    assert recording.notes == ["/gripper/joint_states: on another clock: done without it"]


@pytest.mark.parametrize(
    ("kinds", "named"),
    [
        (("color",), "/camera/color/compressed are -40.0"),
        (("color", "depth", "info"), "/camera/"),
        (("wrench",), "/ft/wrench are -39.9"),
        (("pose",), r"/arm/current_pose are -39.9.* episode.delays.pose: -40.0"),
    ],
)
def test_another_clock_is_refused_with_the_setting_that_mends_it(
    tmp_path, params, kinds, named
) -> None:
    with pytest.raises(UserError, match=named) as caught:
        read(tmp_path, params, change=shift(*kinds, by=-40.0))
    assert "record all topics with one clock" in str(caught.value)


def test_log_time_on_a_clock_of_its_own_or_with_a_step_does_no_harm(tmp_path, params, good) -> None:
    for by, since in ((-1e6, -1.0), (0.9, 2.0), (-0.9, 2.0)):

        def receive(kind, t, delay, by=by, since=since):
            return t + delay + by * (t > since)

        recording = read(tmp_path, params, receive=receive)
        for role, stream in recording.streams.items():
            np.testing.assert_array_equal(stream.stamp, good.streams[role].stamp)
        assert recording.losses == []


@pytest.mark.parametrize("kind", ["wrench", "pose", "depth"])
def test_a_step_in_one_topic_is_refused_by_its_name(tmp_path, params, kind) -> None:
    """Whose clock stepped a comparison of two cannot tell: all against the force's."""
    path = blind_bag(tmp_path, LONG, change=shift(kind, by=0.3, since=3.0))
    found = [*of_topics(part_of(read_recording(path, params.setup), params))]
    words = [str(finding) for finding in found if finding.about == "clock" and finding.refused]
    topics = {"wrench": "/arm/current_pose", "pose": "/arm/current_pose", "depth": "/camera/depth"}
    assert any(topics[kind] in what and "drifts or steps by" in what for what in words)


def test_the_machine_clock_that_is_set_back_is_refused(tmp_path, params) -> None:
    kinds = ("wrench", "pose", "gripper", "color", "depth", "info")
    with pytest.raises(
        UserError, match=r"/ft/wrench: its messages go back by 0\.79. s after 2\.00 s"
    ):
        read(
            tmp_path,
            params,
            change=shift(*kinds, by=-0.80037, since=2.0),
            receive=lambda kind, t, delay: t + delay - 0.80037 * (t >= 2.0),
        )


@pytest.mark.parametrize("late", [-2.8, 1000.0])
def test_a_given_delay_is_taken_off_first(tmp_path, params, good, late) -> None:
    """The refusal says which, to some hundredths of a second."""
    path = blind_bag(tmp_path, change=shift("color", "depth", by=late))
    with pytest.raises(UserError, match=r"episode\.delays\.camera: (\S+) in params") as caught:
        read_recording(path, params.setup)
    summary = float(str(caught.value).partition("camera: ")[2].split()[0])
    assert summary == pytest.approx(late, abs=0.05)
    for camera in (late, summary):
        given = with_(params, "episode.delays", camera=camera)
        recording = read_recording(path, params.setup, given.episode.delays)
        assert recording.late == {"color": camera, "depth": camera}
        off = recording.depth.stamp - good.depth.stamp
        np.testing.assert_allclose(off * 1e-9, late - camera, atol=1e-9)
        right, output = correct_delays(pull_of(recording, params), given)
        assert output.camera.applied and output.camera.value == camera
        np.testing.assert_array_equal(
            right.recording.depth.stamp, recording.depth.stamp
        )  # not twice


MS = 1_000_000


def samples(count: int = 4000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """True times of a 1 kHz sensor [ns], and its noisy values."""
    random = np.random.default_rng(seed)
    return 10**18 + np.arange(count) * MS, random.normal(size=(count, 3))


@given(
    size=st.one_of(st.integers(2, 40), st.sampled_from([64, 250])),
    width=st.sampled_from([0, 8_000, 60_000]),
    late=st.sampled_from([0, 200_000]),
    lost=st.lists(st.integers(10, 90), max_size=3),
    seed=st.integers(0, 99),
)
def test_bursts_are_spread_back_to_where_samples_were_taken(size, width, late, lost, seed) -> None:
    """Whatever their size, with a jitter of the reader, and where whole bursts are lost."""
    true, values = samples(seed=seed)
    random = np.random.default_rng(seed)
    burst = np.arange(len(true)) // size
    end = np.array([true[burst == k][-1] for k in range(burst[-1] + 1)])
    end = end + random.integers(0, late + 1, len(end))
    stamp = end[burst] + (np.arange(len(true)) % size) * min(width, MS // 8 // size)
    retained = ~np.isin(burst, [number * (burst[-1] // 100) for number in lost])
    stamp, true, values = stamp[retained], true[retained], values[retained]
    even, bursts = pace.without_bursts("/x", stamp, stamp + 100_000, values)
    assert bursts.count == size
    whole = slice(size, len(true) - size)
    assert np.abs(even - true)[whole].max() < MS / 2 + 1.5 * late
    assert np.all(np.diff(even) > 0)


def test_a_coarse_clock_is_refused() -> None:
    true, values = samples()
    with pytest.raises(UserError, match="/x: its clock ticks every 10 ms only"):
        pace.without_bursts("/x", true // (10 * MS) * (10 * MS), true + 150_000, values)


@given(
    rate=st.sampled_from([30.0, 100.0, 1000.0]),
    jitter=st.floats(0, 0.3),
    lost=st.floats(0, 0.5),
    seed=st.integers(0, 999),
)
def test_even_stamps_are_left(rate, jitter, lost, seed) -> None:
    random = np.random.default_rng(seed)
    stamp = np.arange(3000) / rate + jitter / rate * random.uniform(-1, 1, 3000)
    stamp = np.sort(np.round(1e9 * stamp[random.random(3000) >= lost]).astype(np.int64))
    values = random.normal(size=(len(stamp), 3))
    assert pace.without_bursts("/x", stamp, stamp, values) is None
    assert pace.hold_of(stamp, values) is None


def test_doubled_messages_are_no_bursts() -> None:
    true, values = samples()
    twice = np.repeat(true, 2)
    assert pace.without_bursts("/x", twice, twice + 1000, np.repeat(values, 2, axis=0)) is None


@given(times=st.integers(2, 60), jitter=st.floats(0, 0.2), rests=st.booleans())
def test_held_values_are_taken_once(times, jitter, rests) -> None:
    """Also of a hand that rests, without noise, half of the time."""
    count = 6000
    random = np.random.default_rng(times)
    stamp = np.round(MS * (np.arange(count) + jitter * random.uniform(-1, 1, count))).astype(int)
    source = np.arange(count) // times * times
    path = np.where(rests & (source < count // 2), 0.0, (source - count / 2) ** 2)
    values = np.stack([path, 0 * path], axis=1)
    hold = pace.hold_of(stamp, values)
    assert hold == pytest.approx(times * MS, rel=0.02)
    retained = pace.first_of_each(stamp, values, hold)
    moving = np.flatnonzero(retained & (np.arange(count) > count // 2 + times))
    np.testing.assert_array_equal(moving % times, 0)
    assert np.diff(stamp[retained]).max() < 2.5 * times * MS  # a rest is no gap


def test_a_coarse_encoder_is_not_held() -> None:
    """It steps by its resolution, at a pace that goes with the speed."""
    t = np.arange(5000)
    path = np.round(400 * np.sin(t / 900)) / 400
    assert pace.hold_of(t * MS, path[:, None]) is None
