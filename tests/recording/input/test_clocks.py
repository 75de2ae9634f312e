"""Clocks: steps and offsets that were put in come out to the period's jitter; good ones are left.

The truth is the stamp before a clock was set: a mended topic must have it again, up to one constant
that all topics share.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.delays import correct_delays
from sling2sim2real.recording.input import clocks
from sling2sim2real.recording.input.reader import Recording, read_recording
from sling2sim2real.recording.pulls import Pull
from tests.project import with_
from validation.recordings.bag import START, Truth, blind_bag, edit, head

MS = 1_000_000


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


def stall(log: np.ndarray, at: float, seconds: float) -> np.ndarray:
    """The recorder writes nothing for a while, and then all at once."""
    begin = log.min() + int(at * 1e9)
    end = begin + int(seconds * 1e9)
    held = (log >= begin) & (log < end)
    late = log.copy()
    late[held] = end + np.arange(held.sum()) * 20_000
    return np.maximum.accumulate(late)


@given(
    rate=st.sampled_from([15.0, 30.0, 50.0, 200.0, 1000.0]),
    seed=st.integers(0, 999),
    jitter=st.sampled_from([0.0, 0.01, 0.1, 0.4]),
    stalls=st.lists(st.tuples(st.floats(0, 5.5), st.floats(0.01, 0.8)), max_size=3),
    lost=st.lists(st.tuples(st.floats(0, 1), st.floats(0, 0.3)), max_size=3),
    log_step=st.sampled_from([0.0, -1.5, 0.2, 5.0]),
    slower=st.sampled_from([0.0, 0.004, 0.05]),
)
def test_a_good_file_is_never_mended(rate, seed, jitter, stalls, lost, log_step, slower) -> None:
    """Stalled recorders, lost messages, a log clock that steps and a network that gets slower."""
    stamp, log = topic(rate, seed=seed, jitter=jitter)
    for at, seconds in stalls:
        log = stall(log, at, seconds)
    half = len(log) // 2
    log[half:] += round(1e9 * (log_step + slower))
    retained = np.ones(len(stamp), bool)
    for share, part in lost:
        first = int(share * len(stamp))
        retained[first : first + int(part * len(stamp))] = False
    if log_step:  # a gap just there, as long as that step, would be a step of the stamps
        retained[half - int(2 * rate) : half + int(2 * rate)] = True
    stamp, log = stamp[retained], log[retained]
    if len(stamp) < 20:
        return
    order = clocks.arrival(stamp, log)
    assert clocks.steps(stamp[order], log[order]) == []
    assert clocks.rewinds(stamp, log) == []
    assert not clocks.outliers(stamp[order], log[order]).any()


@pytest.mark.parametrize("rate", [15.0, 30.0, 200.0, 1000.0])
@pytest.mark.parametrize("size", [-3.7, -0.12, 0.12, 1.2, 3600.0])
def test_a_step_of_the_stamps_is_taken_out(rate, size) -> None:
    true, log = topic(rate, seed=3)
    half = len(true) // 2
    stamp = true.copy()
    stamp[half:] += round(size * 1e9)
    (step,) = clocks.steps(stamp, log)
    assert step.index == half and step.exact
    jitter = 0.02 * 1e9 / rate
    assert abs(step.size - size * 1e9) < 5 * jitter
    mended = clocks.without(stamp, [step])
    assert np.abs(mended - true).max() < 5 * jitter
    np.testing.assert_array_equal(mended[:half], true[:half])
    np.testing.assert_array_equal(clocks.without(stamp, [step], 1)[half:], stamp[half:])


def test_a_step_where_messages_were_lost_and_the_recorder_stalled() -> None:
    true, log = topic(1000.0, seed=4)
    log = stall(log, 2.99, 0.2)
    stamp = true.copy()
    stamp[3000:] += 700 * MS
    retained = np.ones(len(true), bool)
    retained[2995:3005] = False
    (step,) = clocks.steps(stamp[retained], log[retained])
    mended = clocks.without(stamp[retained], [step])
    assert np.abs(mended - true[retained]).max() < 3 * MS  # the stall hides how many were lost


def test_two_steps() -> None:
    true, log = topic(200.0, seed=5)
    stamp = true.copy()
    stamp[400:] += 900 * MS
    stamp[800:] -= 300 * MS
    steps = clocks.steps(stamp, log)
    assert [step.index for step in steps] == [400, 800]
    assert np.abs(clocks.without(stamp, steps) - true).max() < 1 * MS


def test_chunks_in_another_order_or_in_none_are_no_set_clock() -> None:
    stamp, log = topic(1000.0, seed=7)
    chunks = np.r_[0:1000, 3000:4000, 2000:3000, 1000:2000, 4000:6000]
    for order in (chunks, np.random.default_rng(1).permutation(6000)):
        assert clocks.rewinds(stamp[order], log[order]) == []
        result = order[clocks.arrival(stamp[order], log[order])]
        assert np.abs(result - np.arange(6000)).max() < 5  # as their delays have it


def test_stamps_far_from_all_others() -> None:
    stamp, log = topic(200.0, seed=8)
    stamp[[100, 500, 501]] += np.array([10**15, -(10**18), 5 * 10**9])
    np.testing.assert_array_equal(np.flatnonzero(clocks.outliers(stamp, log)), [100, 500, 501])


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


def test_nothing_is_said_of_a_good_file(good) -> None:
    assert good.losses == []
    assert all(stream.notes == [] for stream in good.streams.values())


@pytest.mark.parametrize("kind", ["pose", "gripper"])
def test_another_clock_of_pose_or_gripper_is_put_right(tmp_path, params, good, kind) -> None:
    recording = read(tmp_path, params, change=shift(kind, by=-3600.0))
    mended, true = getattr(recording, kind), getattr(good, kind)
    assert np.abs(mended.stamp - true.stamp).max() < 1 * MS
    np.testing.assert_array_equal(mended.values, true.values)
    assert (
        len(recording.losses) == 1 and "on another clock: +3600.000 s added" in recording.losses[0]
    )


@pytest.mark.parametrize(
    ("kinds", "named"),
    [
        (("color",), "/camera/color/compressed are -40.0"),
        (("color", "depth", "info"), "/camera/"),
        (("wrench",), "/ft/wrench are -39.9"),
    ],
)
def test_another_clock_of_force_or_camera_is_refused(tmp_path, params, kinds, named) -> None:
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


def test_messages_out_of_order_are_sorted_and_said(tmp_path, params, good) -> None:
    recording = read(tmp_path, params, change=shift("pose", by=-0.012, since=2, until=2.005))
    assert recording.losses == ["/arm/current_pose: 1 message out of order, sorted by stamp"]
    assert np.all(np.diff(recording.pose.stamp) > 0)
    assert len(recording.pose.stamp) == len(good.pose.stamp)


@pytest.mark.parametrize("kind", ["wrench", "pose", "gripper", "depth"])
def test_a_step_in_one_topic(tmp_path, params, good, kind) -> None:
    # Whatever part is longer, the part on the others' clock is right.
    for at, part in (("+1.2000 s at 2.0", {"since": 2.0}), ("-1.2000 s at", {"until": 3.0})):
        recording = read(tmp_path, params, change=shift(kind, by=1.2, **part))
        assert np.abs(getattr(recording, kind).stamp - getattr(good, kind).stamp).max() < 0.1 * MS
        (loss,) = recording.losses
        assert f"clock step of {at}" in loss


def test_a_step_in_all_topics_keeps_them_together(tmp_path, params, good) -> None:
    kinds = ("wrench", "pose", "gripper", "color", "depth", "info")
    recording = read(tmp_path, params, change=shift(*kinds, by=0.8, since=2.0))
    for role, stream in recording.streams.items():
        off = stream.stamp - good.streams[role].stamp
        assert np.ptp(off) < 0.1 * MS and abs(np.median(off) - 800 * MS) < 0.1 * MS, role
    assert sum("clock step" in loss for loss in recording.losses) == 5


def test_the_machine_clock_steps_back_in_all_topics(tmp_path, params, good) -> None:
    kinds = ("wrench", "pose", "gripper", "color", "depth", "info")
    recording = read(
        tmp_path,
        params,
        change=shift(*kinds, by=-0.80037, since=2.0),
        receive=lambda kind, t, delay: t + delay - 0.80037 * (t >= 2.0),
    )
    for role, stream in recording.streams.items():
        assert np.abs(stream.stamp - good.streams[role].stamp).max() < 0.1 * MS, role
    assert any("step of its machine's clock of -0.8004 s" in loss for loss in recording.losses)


def test_an_uneven_topic_with_a_step_is_refused(tmp_path, params) -> None:
    def uneven(stamp: int, message) -> None:
        off = np.random.default_rng(stamp % 2**31).uniform(0, 0.0019)
        message.header = head(stamp + round(1e9 * (off + 0.7 * (stamp > START + 2 * 10**9))))

    with pytest.raises(UserError, match="rate is too uneven to tell by how much exactly"):
        read(tmp_path, params, change=edit(wrench=uneven))


def test_an_uneven_gripper_with_a_step_is_put_right(tmp_path, params, good) -> None:
    """To the millisecond that log_time is good to, which is enough for it."""

    def uneven(stamp: int, message) -> bool:
        off = np.random.default_rng(stamp % 2**31).uniform(0, 0.001)
        message.header.stamp.nanosec += round(1e9 * off)
        message.header.stamp.sec += 7 * (stamp > START + 2 * 10**9)
        return stamp // (20 * MS) % 3 != 0  # every third one is missing

    recording = read(tmp_path, params, change=edit(gripper=uneven))
    (loss,) = recording.losses
    assert "/gripper/joint_states: clock step of +6.99" in loss
    near = np.searchsorted(good.gripper.stamp, recording.gripper.stamp - 5 * MS)
    off = recording.gripper.stamp - good.gripper.stamp[near]
    assert np.abs(off).max() < 3 * MS


def test_gaps_and_ends_are_said(tmp_path, params) -> None:
    def lose(stamp: int, message) -> None:
        if 0.8 <= (stamp - START) * 1e-9 < 0.9:
            message.wrench.force.x = float("nan")

    def outside(low: float, high: float):
        return lambda stamp, message: not low < (stamp - START) * 1e-9 < high

    gone = {"pose": outside(3.5, 9.0), "color": outside(1.0, 1.6), "gripper": outside(-1.0, 0.6)}
    recording = read(tmp_path, params, change=edit(wrench=lose, **gone))
    words = "\n".join(recording.losses)
    assert "/ft/wrench: lost 50 not finite" in words
    assert "/ft/wrench: gap of 0.102 s at 0.80 s" in words
    assert "/arm/current_pose: stops 0.70 s before the others" in words
    assert "/gripper/joint_states: starts 0.60 s after the others" in words
    assert "/camera/color/compressed: gap of 0.667 s at 0.94 s" in words
    assert recording.wrench.lost == 50 and np.isfinite(recording.wrench.values).all()


def test_stamps_that_are_missing(tmp_path, params, good) -> None:
    def zero(part: int):
        def bare(stamp: int, message) -> None:
            if stamp % 10**9 % part == 0:
                message.header = head(0)

        return edit(wrench=bare)

    some = read(tmp_path, params, change=zero(100 * MS))
    assert any("without a stamp" in loss for loss in some.losses)
    assert len(some.wrench.stamp) + some.wrench.lost == len(good.wrench.stamp)
    with pytest.raises(UserError, match="/ft/wrench has no header stamps"):
        read(tmp_path, params, change=zero(1))


def test_a_frozen_sensor_is_remarked_on(tmp_path, params) -> None:
    held = {}

    def freeze(stamp: int, message) -> None:
        if 2 * 10**9 <= stamp - START < 2.5e9:
            message.wrench = held.setdefault("wrench", message.wrench)

    recording = read(tmp_path, params, change=edit(wrench=freeze))
    assert any(
        "/ft/wrench: the same value 250 times from 2.00 s" in note for note in recording.notes
    )


def test_shifted_puts_late_stamps_right(good) -> None:
    shifted = good.shifted(pose=0.004, camera=-0.010)
    for role, by in (("pose", 4), ("color", -10), ("depth", -10), ("wrench", 0), ("gripper", 0)):
        off = good.streams[role].stamp - shifted.streams[role].stamp
        np.testing.assert_array_equal(off, by * MS)


@pytest.mark.parametrize("late", [-2.8, 0.66, 1000.0])
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
        right, output = correct_delays(Pull.of(recording, params.setup), given)
        assert output.camera.applied and output.camera.value == camera
        np.testing.assert_array_equal(
            right.recording.depth.stamp, recording.depth.stamp
        )  # not twice


@pytest.mark.parametrize("rate", [-3e-3, 0.0, 5e-4])
def test_a_drift_is_told_by_the_least_delays(rate) -> None:
    for seed in range(5):
        stamp = np.arange(0, 9 * 10**9, 10**6)
        waits = np.random.default_rng(seed).exponential(2e5, len(stamp)).astype(np.int64)
        drift, error = clocks.drift((stamp * (1 + rate)).astype(np.int64), stamp + 10**6 + waits)
        assert abs(drift + rate) < 5 * error and error < 1e-5
    assert clocks.drift(stamp[:1000], stamp[:1000])[1] == np.inf


LONG = Truth(end=9.0)


@pytest.fixture(scope="module")
def sound(tmp_path_factory, params) -> Recording:
    return read(tmp_path_factory.mktemp("long"), params, truth=LONG)


@pytest.mark.parametrize("roles", [("wrench",), ("color", "depth"), ("pose",)])
@pytest.mark.parametrize("rate", [-3e-3, 1.5e-3])
def test_a_clock_that_drifts_is_put_at_the_forces_rate(
    tmp_path, params, sound, roles, rate
) -> None:
    """And stays as late as it was at its first message."""

    def drifts(stamp: int, message) -> None:
        late = round((stamp - START) * rate)
        message.header = head(stamp + late, message.header.frame_id)

    odd = read(tmp_path, params, truth=LONG, change=edit(**dict.fromkeys(roles, drifts)))
    by_force = rate * ("wrench" in roles)  # whose clock counts
    for role, stream in odd.streams.items():
        moves = role != "wrench" and (role in roles or "wrench" in roles)
        assert stream.drift.taken_out == moves and not sound.streams[role].drift.matters
        time = sound.streams[role].seconds(sound.origin)
        np.testing.assert_allclose(stream.seconds(odd.origin), (1 + by_force) * time, atol=2e-3)


def test_topics_of_one_clock_are_weighed() -> None:
    both = [(1e-3, 1e-5), (2e-3, 1e-4)]
    rate, error = clocks.of_one_clock(both)
    assert 1e-3 < rate < 1.02e-3 and error == 1e-5
    assert clocks.of_one_clock([both[0], (0.0, np.inf)]) == (1e-3, 1e-5)
    assert clocks.of_one_clock([(0.0, np.inf)] * 2)[1] == np.inf
