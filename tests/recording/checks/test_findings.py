"""What the checks find in recordings that are changed in one thing, and in sound ones nothing."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.recording.checks import camera, container, force, frames, motion, pictures, times
from pipeline.recording.checks.motion import pause
from pipeline.recording.checks.table import CHECKS, findings_of
from pipeline.recording.delays import Estimate
from tests.recording.checks.made import abouts, with_facts, with_recording, with_results


def test_names_are_of_rows(checked) -> None:
    names = [check.name for check in CHECKS]
    assert len(set(names)) == len(names)
    assert abouts(checked.findings) <= set(names)
    assert {"picture_rate"} == abouts(checked.findings) - {"pause"}  # as it was made


def test_what_is_lost_is_said_once(checked) -> None:
    note = "no checksums in the file: damage to its messages would not be noticed"
    odd = with_recording(checked, notes=[note], losses=["a chunk is damaged", "another is"])
    said = list(container.findings(odd))
    assert [one.about for one in said] == ["checksums", "losses"]
    assert said[1].what == "2 things were lost or mended, first of all: a chunk is damaged"


def test_facts_of_the_signals_tell(checked) -> None:
    facts = {"drift": [0.0, 1.0, 0.0], "release_error": 0.004, "slips": [1.5], "noise": 2.0}
    assert not abouts(force.findings(checked))
    odd = with_facts(checked, **facts)
    assert abouts(force.findings(odd)) == {"noise", "drift", "release", "slip"}
    turned = with_facts(checked, turn=np.deg2rad(3.0))
    assert "turn" in abouts(motion.findings(turned))
    early = replace(checked.signals, grasp_time=0.3 - checked.start)
    assert "lead_in" in abouts(motion.findings(with_results(checked, signals=early)))


def test_delays_that_the_recording_shows_are_said(checked) -> None:
    for late, error, said in ((0.012, 0.001, True), (0.012, 0.005, False), (0.001, 1e-4, False)):
        pose = Estimate(late, error, "estimated", applied=True)
        odd = replace(checked, delays=replace(checked.delays, pose=pose))
        assert ("delay" in abouts(times.findings(odd))) == said


def test_times_of_receipt_tell_of_another_clock(checked) -> None:
    """A picture may come late, by a slow driver, and not before it was taken."""
    recording = checked.pull.recording
    poses, seen = (
        {0.3: True, -0.05: True, -0.01: False},
        {0.045: True, -0.06: False, -0.2: True},
    )
    for role, cases in (("pose", poses), ("color", seen)):
        for offset, said in cases.items():
            stream = replace(getattr(recording, role), delay=recording.wrench.delay - offset)
            found = times.findings(with_recording(checked, **{role: stream}))
            words = [one.what for one in found if one.about == "clock"]
            assert len(words) == said and all(f"{offset:+.3f} s" in what for what in words)


def test_pictures_without_a_band_are_said(checked) -> None:
    none = [np.zeros((0, 3), np.float32)] * 20
    points = [*checked.clouds.points[:-20], *none]
    clouds = replace(checked.clouds, points=points, damaged=20, unpaired=20)
    found = abouts(pictures.findings(with_results(checked, clouds=clouds)))
    assert found == {"empty", "damaged", "unpaired"}
    low = [replace(row, coverage=0.5) for row in checked.coverage if row.phase == "drawn"]
    assert abouts(pictures.of_coverage(low)) == {"coverage", "unseen"}


def test_a_camera_that_stops_before_the_release_is_said(checked) -> None:
    rows = [row for row in checked.coverage if row.phase in ("hanging", "held", "drawn")]
    said = [one.what for one in pictures.of_coverage(rows) if one.about == "unseen"]
    assert said == [f"no picture shows how the band {how}" for how in ("recoils", "swings")]


def test_a_band_that_is_never_taut_refuses(checked) -> None:
    long = replace(checked, band=checked.band.model_copy(update={"rest_length": 1.2}))
    last = findings_of(long)[-1]
    assert last.refused and last.about == "drawn" and long.refusal == last
    assert "drawn taut at a rest length of 1.2 m: check" in str(last)


def test_a_sensor_that_tf_static_does_not_know_is_said(checked) -> None:
    assert not list(frames.findings(checked))
    wrench = replace(checked.pull.recording.wrench, frame="elsewhere")
    (said,) = frames.findings(with_recording(checked, wrench=wrench))
    assert said.about == "sensor" and "'elsewhere'" in said.what


def test_tips_are_off_from_what_one_component_is_sure_of(checked) -> None:
    assert not abouts(camera.findings(checked))
    assert "extrinsics" in abouts(camera.findings(with_results(checked, tips=None)))
    for off, error, said in ((0.0039, 0.0001, 0), (0.0045, 0.0014, 0), (0.0045, 0.0012, 1)):
        offsets, errors = np.zeros((2, 3)), np.full((2, 3), error)
        offsets[0, 0] = off
        offsets[:, 2], errors[:, 2] = 0.02, 0.01  # the least certain direction says nothing
        tips = replace(checked.tips, offsets=offsets, errors=errors)
        assert ("extrinsics" in abouts(camera.findings(with_results(checked, tips=tips)))) == said
    away = replace(checked.tips, hand=np.array([0.0, 0.05, 0.0]))
    assert "hand" in abouts(camera.findings(with_results(checked, tips=away)))


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


def test_a_step_that_fails_refuses_and_is_the_last_finding(checked) -> None:
    short = checked.pull.recording.wrench.between(0, checked.pull.recording.origin + 10**9)
    found = findings_of(with_recording(checked, wrench=short))
    assert found[-1].about == "pull" and found[-1].refused and not found[-1].cure


def test_a_clock_that_runs_fast_is_said(checked) -> None:
    """By the growth of log_time less stamp; one that scatters as much says nothing."""
    pose = checked.pull.recording.pose
    for rate, error, said in ((2e-3, 1e-5, True), (2e-3, 1e-3, False), (1e-5, 1e-6, False)):
        force = replace(checked.pull.recording.wrench, drift=(rate, error))
        odd = with_recording(checked, wrench=force, pose=replace(pose, drift=(0.0, 1e-6)))
        words = [one.what for one in times.findings(odd) if one.about == "clock_drift"]
        assert any(pose.topic in what and "+2000" in what for what in words) == said


def test_a_pose_that_nothing_ties_to_the_force_is_said(checked) -> None:
    for left, said in ((0.003, True), (0.001, False), (None, False)):
        odd = replace(checked, delays=replace(checked.delays, pose=Estimate(left=left)))
        assert ("clock_unknown" in abouts(times.findings(odd))) == said
