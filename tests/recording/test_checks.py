"""What the checks find in what is changed in one thing, and in sound recordings nothing."""

import ast
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.build import process
from sling2sim2real.recording.checks import CHECKS, of_calibration, of_topics, pause
from sling2sim2real.recording.delays import Estimate
from sling2sim2real.recording.events import Part
from sling2sim2real.recording.force import flat_top, sensor_turns
from sling2sim2real.recording.pace import Bursts
from tests.project import with_
from tests.recording.conftest import (
    abouts,
    of_pictures,
    of_signals,
    with_facts,
    with_force,
    with_recording,
)


def test_each_check_has_a_test_of_a_recording_on_which_it_fires() -> None:
    marked = set()
    for file in Path(__file__).parent.rglob("test_*.py"):
        for text in re.findall(r"@pytest\.mark\.fires\(([^)]*)\)", file.read_text()):
            marked |= set(ast.literal_eval(f"({text},)"))
    assert marked == {*CHECKS}


def test_a_sound_recording_is_left(processed, checked, params) -> None:
    assert {finding.what for finding in processed.findings if finding.about == "rate"} == {
        "pictures come at 15 Hz, so few of them show the recoil"  # as it was made
    }
    assert abouts(processed.findings) <= {"rate", "pause"}
    assert abouts(of_signals(checked, params)) <= {"pause"}


@pytest.mark.fires("losses")
def test_what_is_lost_is_said_once(checked) -> None:
    odd = with_recording(checked, losses=["a chunk is damaged", "another is"])
    (message,) = (finding for finding in of_topics(odd) if finding.about == "losses")
    assert message.what == "2 things were lost or mended, first of all: a chunk is damaged"


@pytest.mark.fires("gripper")
def test_a_gripper_that_was_not_recorded_is_said(checked) -> None:
    assert "gripper" in abouts(of_topics(with_recording(checked, gripper=None)))


@pytest.mark.fires("gap", "rate")
def test_lost_and_rare_messages_are_said(checked) -> None:
    recording = checked.pull.recording

    def message(role: str, retained: np.ndarray) -> list[str]:
        stream = getattr(recording, role)
        retained = np.flatnonzero(retained[: len(stream.stamp)])
        thinned = replace(stream, stamp=stream.stamp[retained], values=stream.values[retained])
        return [finding.what for finding in of_topics(with_recording(checked, **{role: thinned}))]

    number = np.arange(len(recording.wrench.stamp))
    as_made = message("wrench", number >= 0)
    for retained, words in (
        ((number < 1000) | (number > 1040), "has a gap of 0.0"),
        (number % 15 != 3, "are missing"),
        (number % 2 == 0, "the force comes at 500 Hz"),
    ):
        (what,) = set(message("wrench", retained)) - {*as_made}
        assert words in what
    assert any("pictures come at 8 Hz" in what for what in message("depth", number % 2 == 0))


@pytest.mark.fires("stamps")
def test_bursts_and_held_values_are_said(checked) -> None:
    wrench, pose = checked.pull.recording.wrench, checked.pull.recording.pose
    bursts = replace(wrench, bursts=Bursts(16, 16e6, 3e5))
    assert "stamps" in abouts(of_topics(with_recording(checked, wrench=bursts)))
    held = replace(pose, hold=0.033)
    assert "stamps" in abouts(of_topics(with_recording(checked, pose=held)))


@pytest.mark.fires("clock")
def test_times_of_receipt_tell_of_another_clock(checked) -> None:
    """A picture may come late, by a slow driver, and not before it was taken."""
    recording = checked.pull.recording
    poses, seen = ({0.3: True, -0.05: True, -0.01: False}, {0.045: True, -0.06: False, -0.2: True})
    for role, cases in (("pose", poses), ("color", seen)):
        for offset, message in cases.items():
            stream = replace(
                getattr(recording, role), receipt_delay=recording.wrench.receipt_delay - offset
            )
            findings = of_topics(with_recording(checked, **{role: stream}))
            words = [finding.what for finding in findings if finding.about == "clock"]
            assert len(words) == message and all(f"{offset:+.3f} s" in what for what in words)


def test_a_clock_that_drifts_or_steps_is_said_by_its_name(checked) -> None:
    pose = checked.pull.recording.pose
    for drift, refused, words in (
        ((0.005, 0.001), False, "drifts or steps by +5.0 ± 1.0 ms"),
        ((-0.005, 0.001), False, "drifts or steps by -5.0 ± 1.0 ms"),
        ((0.060, 0.001), True, "drifts or steps by +60.0"),
        ((0.005, 0.004), False, ""),
        ((0.002, 0.0001), False, ""),
    ):
        odd = with_recording(checked, pose=replace(pose, drift=drift))
        found = [finding for finding in of_topics(odd) if finding.about == "clock"]
        assert len(found) == bool(words)
        assert all(words in one.what and one.refused == refused for one in found)


@pytest.mark.fires("frames")
def test_frames_that_are_not_there_or_twice_are_said(checked) -> None:
    assert "frames" not in abouts(of_topics(with_recording(checked)))
    wrench = replace(checked.pull.recording.wrench, frame="elsewhere")
    words = [finding.what for finding in of_topics(with_recording(checked, wrench=wrench))]
    assert any("does not know the force's frame 'elsewhere'" in what for what in words)
    geometry = replace(checked.pull.geometry, contradiction="1 m off")
    assert "frames" in abouts(of_topics(Part(checked.pull.recording, geometry)))


@pytest.mark.fires("delay")
def test_delays_that_the_recording_shows_are_said(checked, params) -> None:
    for late, error, message in ((0.012, 0.001, True), (0.012, 0.005, False), (0.001, 1e-4, False)):
        pose = Estimate(late, error, "estimated", applied=True)
        odd = replace(checked, delays=replace(checked.delays, pose=pose))
        assert ("delay" in abouts(of_signals(odd, params))) == message
    for left, message in ((0.003, True), (0.001, False), (None, False)):
        odd = replace(checked, delays=replace(checked.delays, pose=Estimate(left=left)))
        assert ("delay" in abouts(of_signals(odd, params))) == message
    alone = Estimate(0.012, 0.001, "estimated", left=0.012, alone=True)
    odd = replace(checked, delays=replace(checked.delays, pose=alone))
    (refused,) = (finding for finding in of_signals(odd, params) if finding.refused)
    assert "the robot moves by itself" in refused.what and "pose in params" in refused.cure
    odd = replace(checked, delays=replace(checked.delays, conflict="one says 3 ms, one -9 ms"))
    assert "one says 3 ms, one -9 ms" in [finding.what for finding in of_signals(odd, params)]


@pytest.mark.fires("zero", "release", "max_force")
def test_facts_of_the_signals_tell(checked, params) -> None:
    facts = {"drift": [0.0, 1.0, 0.0], "release_error": 0.004, "slips": [1.5]}
    odd = of_signals(with_facts(checked, **facts), params)
    assert abouts(odd) - {"pause"} == {"zero", "release"} and len(odd) >= 3
    weak = with_(params, "setup", max_force=1.0)
    assert "max_force" in abouts(of_signals(checked, weak))


@pytest.mark.fires("pause")
def test_what_the_hand_should_not_do_is_said(checked, params) -> None:
    signals = checked.signals
    rising = replace(signals, force=signals.force * (1 + 0.2 * signals.time[:, None]))
    assert "pause" in abouts(of_signals(replace(checked, signals=rising), params))
    second = replace(checked, pull=replace(checked.pull, number=2, count=2))
    words = [finding.what for finding in of_signals(second, params)]
    assert any("after the pull before, the band may still swing" in what for what in words)


def test_the_pause_before_the_release(checked, seen) -> None:
    still, change = pause(checked.signals)
    truth = seen[1]
    assert still == pytest.approx(truth.release - truth.drawn, abs=0.25)  # it creeps to its end
    assert change < 0.005
    signals = checked.signals
    rising = replace(signals, force=signals.force * (1 + 0.2 * signals.time[:, None]))
    release = signals.release_time
    middle = 1 + 0.2 * (release - 0.3)
    assert pause(rising)[1] == pytest.approx(0.5 * 0.2 / middle, rel=0.1)


@pytest.mark.fires("damaged", "coverage")
def test_pictures_without_a_band_are_said(checked) -> None:
    assert not of_pictures(checked)
    none = [np.zeros((0, 3), np.float32)] * 20
    points = [*checked.clouds.points[:-20], *none]
    clouds = replace(checked.clouds, points=points, damaged=20, unpaired=20)
    words = [finding.what for finding in of_pictures(replace(checked, clouds=clouds))]
    assert len(words) == 3 and words[0].startswith("20 of ")
    assert all(word in "\n".join(words) for word in ("cannot be decoded", "no colour picture"))
    low = [replace(row, coverage=0.5) for row in checked.coverage if row.phase == "drawn"]
    found = of_pictures(replace(checked, coverage=low))
    assert "50 % of the band is covered while it is drawn" in found[0].what
    assert {finding.what for finding in found[1:]} == {
        f"no picture shows how the band {how}" for how in ("hangs", "recoils", "swings")
    }


def test_a_band_that_is_never_taut_refuses(checked, params) -> None:
    long = params.bands["band1"].model_copy(update={"rest_length": 1.2})
    part = with_recording(checked)
    done = process(part, long, params)
    assert done.refusal and done.refusal == done.findings[-1]
    assert "drawn taut at a rest length of 1.2 m: check" in str(done.refusal)


@pytest.mark.fires("off_plane")
def test_points_of_the_arm_are_said(checked) -> None:
    rows = [replace(row, off_plane=0.05) for row in checked.coverage]
    assert "off_plane" in abouts(of_pictures(replace(checked, coverage=rows)))


@pytest.mark.fires("extrinsics")
def test_tips_are_off_from_what_one_component_is_sure_of(checked) -> None:
    geometry, seen = checked.pull.geometry, checked.calibration
    assert not abouts(of_calibration(seen, geometry))
    assert "extrinsics" in abouts(of_calibration(None, geometry))
    for off, error, message in ((0.0039, 0.0001, 0), (0.0045, 0.0014, 0), (0.0045, 0.0012, 1)):
        camera = np.array([off, 0.0, 0.02])  # the least certain direction says nothing
        odd = replace(seen, camera=camera, camera_error=np.array([error, error, 0.01]))
        assert ("extrinsics" in abouts(of_calibration(odd, geometry))) == message
    away = replace(seen, hand=np.array([0.0, 0.05, 0.0]))
    assert "extrinsics" in abouts(of_calibration(away, geometry))


@pytest.mark.fires("pull")
def test_a_step_that_fails_refuses_and_is_the_last_finding(checked, params) -> None:
    recording = checked.pull.recording
    short = recording.wrench.between(0, recording.origin + 10**9)
    done = process(with_recording(checked, wrench=short), params.bands["band1"], params)
    last = done.findings[-1]
    assert last.about == "pull" and last.refused and not last.cure
    assert done.signals is None and done.whole is None
    with pytest.raises(UserError, match="at"):
        done.check([])


def turned(done, params, axis: str, degrees: float):
    turn = sensor_turns(done.pull.motion, done.pull.geometry, done.pull.force_time[:1])[0]
    turn = turn.inv() * Rotation.from_euler(axis, degrees, degrees=True) * turn
    return with_force(done, lambda _, values: turn.apply(values), params)


@pytest.mark.fires("direction")
@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("degrees", [-28, -15, -6, 6, 15, 28])
def test_a_turned_sensor(checked, params, axis, degrees) -> None:
    message = [
        finding
        for finding in of_signals(turned(checked, params, axis, degrees), params)
        if finding.about == "direction"
    ]
    assert len(message) == 1 and message[0].refused == (abs(degrees) > 12)
    way = {"x": ("presses down", "lifts"), "z": ("to the right", "to the left")}[axis]
    assert way[degrees > 0] in message[0].what


@pytest.mark.fires("range")
@pytest.mark.parametrize("share", [0.3, 0.7, 0.95])
def test_a_range_that_ends(checked, params, share) -> None:
    peak = share * np.linalg.norm(checked.signals.facts.hold_force)

    def clipped(t, values):
        rest = values[t < 0.5].mean(axis=0)
        k = int(np.argmax(np.ptp(values, axis=0)))
        most = peak * np.ptp(values[:, k]) / np.linalg.norm(checked.signals.facts.hold_force)
        values = values.copy()
        values[:, k] = np.clip(values[:, k], rest[k] - most, rest[k] + most)
        return values

    message = of_signals(with_force(checked, clipped, params), params)
    assert [finding.about for finding in message if finding.refused][0] == "range"
    assert "its range ends" in "".join(finding.what for finding in message)


@pytest.mark.parametrize("every", [1, 20])
def test_a_hand_that_moves_before_the_pull_is_no_noise(checked, every) -> None:
    """A filter leaves little noise, and little of it is left while the tool is shaken."""
    wrench, t = checked.pull.recording.wrench, checked.pull.force_time
    smooth = lfilter(np.ones(30) / 30, 1, wrench.values - wrench.values[0], axis=0)
    shaken = 2.0 * np.sin(25 * t) * ((t > 0.1) & (t < 0.4))
    values = wrench.values[0] + smooth + shaken[:, None]
    changed = replace(wrench, stamp=wrench.stamp[::every], values=values[::every])
    recording = replace(checked.pull.recording, wrench=changed)
    assert flat_top(replace(checked.pull, recording=recording)) is None


@pytest.mark.fires("units")
def test_units(checked, params) -> None:
    for newtons, refused in ((1e-3, True), (9.81, False)):
        odd = with_force(checked, lambda _, values, by=newtons: values / by, params)
        message = of_signals(odd, params)
        units = [finding for finding in message if finding.about == "units"]
        assert units and units[0].refused == refused and "publish newtons" in units[0].cure
    with pytest.raises(UserError, match="or it is not in newtons"):
        with_force(checked, lambda _, values: values / 1e3, params)


@pytest.mark.fires("filter")
@pytest.mark.parametrize("count", [10, 20, 40])
def test_a_filtered_force(checked, params, count) -> None:
    """A moving average: its release is unsure by what it delays."""

    def averaged(_, values):
        return values[0] + lfilter(np.ones(count) / count, 1, values - values[0], axis=0)

    odd = with_force(checked, averaged, params)
    assert "filter" in abouts(of_signals(odd, params))
    late = (count - 1) / 2 * odd.pull.recording.wrench.period
    assert odd.pull.release.error > late / 2


@pytest.mark.parametrize("at", [0.3, 1.2, 2.0])
def test_a_sensor_that_is_zeroed_while_recording_is_refused(checked, params, at) -> None:
    """While free, slack or drawn: its own values then are taken off."""

    def zeroed(t, values):
        level = values[(t > at - 0.05) & (t < at)].mean(axis=0)
        return values - np.outer(t > at, level)

    try:
        found = of_signals(with_force(checked, zeroed, params), params)
    except UserError as error:
        assert "zeroed" in str(error)
    else:
        assert any(finding.about == "zero" and finding.refused for finding in found)


@pytest.mark.parametrize(("share", "refused"), [(0.05, False), (0.2, True)])
def test_a_zero_that_does_not_return(checked, params, share, refused) -> None:
    release = checked.pull.release.time
    by = share * np.linalg.norm(checked.signals.facts.hold_force) / np.sqrt(3)
    odd = with_force(checked, lambda t, x: x + by * (t > release + 0.01)[:, None], params)
    (message,) = (finding for finding in of_signals(odd, params) if finding.about == "zero")
    assert message.refused == refused and "after the release" in message.what
