"""What the checks find in recordings that are changed in one thing, and in sound ones nothing."""

import ast
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.recording.checks import (
    camera,
    container,
    force,
    frames,
    motion,
    pictures,
    rates,
    roles,
    times,
)
from sling2sim2real.recording.checks.motion import pause
from sling2sim2real.recording.checks.table import CHECKS, findings_of
from sling2sim2real.recording.delays import Estimate
from sling2sim2real.recording.input.clocks import ClockRate
from sling2sim2real.recording.tips import LensFactor
from tests.project import with_
from tests.recording.checks.made import abouts, with_facts, with_recording, with_results


def test_each_check_has_a_test_of_a_recording_on_which_it_fires() -> None:
    marked = set()
    for file in Path(__file__).parents[1].rglob("test_*.py"):
        for text in re.findall(r"@pytest\.mark\.fires\(([^)]*)\)", file.read_text()):
            marked |= set(ast.literal_eval(f"({text},)"))
    assert marked == {check.name for check in CHECKS}


def test_names_are_of_rows(checked) -> None:
    names = [check.name for check in CHECKS]
    assert len(set(names)) == len(names)
    assert abouts(checked.findings) <= set(names)
    assert {"picture_rate"} == abouts(checked.findings) - {"pause"}  # as it was made


@pytest.mark.fires("checksums", "losses")
def test_what_is_lost_is_said_once(checked) -> None:
    note = "no checksums in the file: damage to its messages would not be noticed"
    odd = with_recording(checked, notes=[note], losses=["a chunk is damaged", "another is"])
    message = list(container.findings(odd))
    assert [finding.about for finding in message] == ["checksums", "losses"]
    assert message[1].what == "2 things were lost or mended, first of all: a chunk is damaged"


@pytest.mark.fires("noise", "drift", "release", "slip", "turn", "lead_in")
def test_facts_of_the_signals_tell(checked) -> None:
    facts = {"drift": [0.0, 1.0, 0.0], "release_error": 0.004, "slips": [1.5], "noise": 2.0}
    assert not abouts(force.findings(checked))
    odd = with_facts(checked, **facts)
    assert abouts(force.findings(odd)) == {"noise", "drift", "release", "slip"}
    turned = with_facts(checked, turn=np.deg2rad(3.0))
    assert "turn" in abouts(motion.findings(turned))
    early = replace(checked.signals, grasp_time=0.3 - checked.start)
    assert "lead_in" in abouts(motion.findings(with_results(checked, signals=early)))


@pytest.mark.fires("delay")
def test_delays_that_the_recording_shows_are_said(checked) -> None:
    for late, error, message in ((0.012, 0.001, True), (0.012, 0.005, False), (0.001, 1e-4, False)):
        pose = Estimate(late, error, "estimated", applied=True)
        odd = replace(checked, delays=replace(checked.delays, pose=pose))
        assert ("delay" in abouts(times.findings(odd))) == message


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
            findings = times.findings(with_recording(checked, **{role: stream}))
            words = [finding.what for finding in findings if finding.about == "clock"]
            assert len(words) == message and all(f"{offset:+.3f} s" in what for what in words)


@pytest.mark.fires("empty", "damaged", "unpaired", "coverage")
def test_pictures_without_a_band_are_said(checked) -> None:
    none = [np.zeros((0, 3), np.float32)] * 20
    points = [*checked.clouds.points[:-20], *none]
    clouds = replace(checked.clouds, points=points, damaged=20, unpaired=20)
    names = abouts(pictures.findings(with_results(checked, clouds=clouds)))
    assert names == {"empty", "damaged", "unpaired"}
    low = [replace(row, coverage=0.5) for row in checked.coverage if row.phase == "drawn"]
    assert abouts(pictures.of_coverage(low)) == {"coverage", "unseen"}


@pytest.mark.fires("unseen")
def test_a_camera_that_stops_before_the_release_is_said(checked) -> None:
    rows = [row for row in checked.coverage if row.phase in ("hanging", "held", "drawn")]
    message = [finding.what for finding in pictures.of_coverage(rows) if finding.about == "unseen"]
    assert message == [f"no picture shows how the band {how}" for how in ("recoils", "swings")]


@pytest.mark.fires("drawn")
def test_a_band_that_is_never_taut_refuses(checked) -> None:
    long = replace(checked, band=checked.band.model_copy(update={"rest_length": 1.2}))
    last = findings_of(long)[-1]
    assert last.refused and last.about == "drawn" and long.refusal == last
    assert "drawn taut at a rest length of 1.2 m: check" in str(last)


@pytest.mark.fires("sensor")
def test_a_sensor_that_tf_static_does_not_know_is_said(checked) -> None:
    assert not list(frames.findings(checked))
    wrench = replace(checked.pull.recording.wrench, frame="elsewhere")
    (message,) = frames.findings(with_recording(checked, wrench=wrench))
    assert message.about == "sensor" and "'elsewhere'" in message.what


@pytest.mark.fires("extrinsics", "hand")
def test_tips_are_off_from_what_one_component_is_sure_of(checked) -> None:
    assert not abouts(camera.findings(checked))
    assert "extrinsics" in abouts(camera.findings(with_results(checked, tips=None)))
    for off, error, message in ((0.0039, 0.0001, 0), (0.0045, 0.0014, 0), (0.0045, 0.0012, 1)):
        offsets, errors = np.zeros((2, 3)), np.full((2, 3), error)
        offsets[0, 0] = off
        offsets[:, 2], errors[:, 2] = 0.02, 0.01  # the least certain direction says nothing
        tips = replace(checked.tips, offsets=offsets, errors=errors)
        assert (
            "extrinsics" in abouts(camera.findings(with_results(checked, tips=tips)))
        ) == message
    away = replace(checked.tips, hand=np.array([0.0, 0.05, 0.0]))
    assert "hand" in abouts(camera.findings(with_results(checked, tips=away)))


@pytest.mark.fires("lens")
def test_a_lens_that_explains_what_is_off_is_said(checked) -> None:
    offsets = checked.tips.offsets + [0.02, 0.0, 0.0]
    for kind in ("depth", "width"):
        tips = replace(checked.tips, offsets=offsets, lens=LensFactor(kind, 1.02, 0.001))
        message = [*camera.findings(with_results(checked, tips=tips))]
        assert abouts(message) == {"lens"} and "1.020 ± 0.001" in message[0].what


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


@pytest.mark.fires("pull")
def test_a_step_that_fails_refuses_and_is_the_last_finding(checked) -> None:
    short = checked.pull.recording.wrench.between(0, checked.pull.recording.origin + 10**9)
    findings = findings_of(with_recording(checked, wrench=short))
    assert findings[-1].about == "pull" and findings[-1].refused and not findings[-1].cure


@pytest.mark.fires("gap", "missing", "force_rate", "picture_rate")
def test_lost_and_rare_messages_are_said(checked) -> None:
    recording = checked.pull.recording

    def message(role: str, retained: np.ndarray) -> set[str]:
        stream = getattr(recording, role)
        retained = retained[: len(stream.stamp)]
        values = stream.values
        values = (
            [values[i] for i in np.flatnonzero(retained)] if role == "depth" else values[retained]
        )
        thinned = replace(stream, stamp=stream.stamp[retained], values=values)
        return abouts(rates.findings(with_recording(checked, **{role: thinned})))

    number = np.arange(len(recording.wrench.stamp))
    as_made = abouts(rates.findings(checked))
    assert message("wrench", (number < 1000) | (number > 1040)) - as_made == {"gap"}
    assert message("wrench", number % 15 != 3) - as_made == {"missing"}
    assert message("wrench", number % 2 == 0) - as_made == {"force_rate"}
    assert "picture_rate" in message("depth", number % 2 == 0)


@pytest.mark.fires("gripper")
def test_a_gripper_that_was_not_recorded_is_said(checked) -> None:
    assert not list(roles.findings(checked))
    assert abouts(roles.findings(with_recording(checked, gripper=None))) == {"gripper"}


@pytest.mark.fires("max_force", "pause", "rest")
def test_what_the_hand_should_not_do_is_said(checked) -> None:
    weak = with_(checked.params, "setup", max_force=1.0)
    assert "max_force" in abouts(force.findings(replace(checked, params=weak)))
    signals = checked.signals
    rising = replace(signals, force=signals.force * (1 + 0.2 * signals.time[:, None]))
    assert "pause" in abouts(motion.findings(with_results(checked, signals=rising)))
    second = replace(checked, pull=replace(checked.pull, number=2, count=2))
    assert "rest" in abouts(motion.findings(second))


@pytest.mark.fires("off_plane")
def test_points_of_the_arm_are_said(checked) -> None:
    rows = [replace(row, off_plane=0.05) for row in checked.coverage if row.phase == "hanging"]
    assert "off_plane" in abouts(pictures.of_coverage(rows))


@pytest.mark.fires("loop")
def test_a_loop_of_poses_that_does_not_close_is_said(checked) -> None:
    loop = SimpleNamespace(closed=False)
    geometry = replace(checked.pull.geometry, loop=loop)
    open_ = replace(checked, pull=replace(checked.pull, geometry=geometry))
    assert "loop" in abouts(frames.findings(open_))


@pytest.mark.fires("clock_drift")
def test_a_clock_that_runs_fast_is_said(checked) -> None:
    """By the growth of log_time less stamp; one that scatters as much says nothing."""
    pose = checked.pull.recording.pose
    for rate, error, message in (
        (2e-3, 1e-5, "taken out"),
        (2e-3, 3e-4, "not steady enough"),
        (2e-3, 1e-3, ""),
        (1e-5, 1e-6, ""),
    ):
        odd = with_recording(checked, pose=replace(pose, drift=ClockRate(rate, error, 4.0)))
        words = [finding.what for finding in times.findings(odd) if finding.about == "clock_drift"]
        assert any(pose.topic in what and "+2000" in what for what in words) == bool(message)
        assert all(message in what for what in words)


@pytest.mark.fires("clock_unknown")
def test_a_pose_that_nothing_ties_to_the_force_is_said(checked) -> None:
    for left, message in ((0.003, True), (0.001, False), (None, False)):
        odd = replace(checked, delays=replace(checked.delays, pose=Estimate(left=left)))
        assert ("clock_unknown" in abouts(times.findings(odd))) == message


@pytest.mark.fires("clocks_disagree")
def test_two_estimates_of_a_delay_that_disagree_are_said(checked) -> None:
    odd = replace(checked, delays=replace(checked.delays, conflict="one says 3 ms, one -9 ms"))
    message = [
        finding.what for finding in times.findings(odd) if finding.about == "clocks_disagree"
    ]
    assert message == ["one says 3 ms, one -9 ms"]
