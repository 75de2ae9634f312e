"""Several pulls in one file: each becomes what it would be in a file of its own."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import build, events, streams
from sling2sim2real.recording.build import build_episodes, process_recording
from sling2sim2real.recording.events import Part, Pull, parts_of
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.motion import Motion
from sling2sim2real.recording.streams import read_recording
from tests.project import with_
from tests.recording.conftest import part_of, pull_of, written
from tests.recording.parts import joined
from validation.recordings.bag import START, Truth, blind_bag, edit

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
        hand = np.array([truth.hand(t) for t in time])
        np.testing.assert_allclose(episode.position[calm], hand[calm], atol=3e-4)

        assert single.metadata["input"]["pull"] == 1
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
    """One motion for the stamps as recorded; another one where the pose's are corrected."""
    calls: Counter[str] = Counter()

    def count(module, name: str) -> None:
        real = getattr(module, name)

        def counted(*given, **named):
            calls[name] += 1
            return real(*given, **named)

        monkeypatch.setattr(module, name, counted)

    count(streams, "read_container")
    count(build, "geometry_of")
    count(Motion, "of")
    for name in ("find_releases", "find_release", "find_grasp"):
        count(events, name)
    given = with_(params, "episode.delays", pose=delay, camera=None)
    build_episodes(seen[0], "band1", given)
    assert calls == {
        "read_container": 1,
        "geometry_of": 1,
        "find_releases": 1,  # whether there are several
        "find_release": 1,
        "of": 1,
        "find_grasp": 1,  # a given delay is taken off as the file is read
    }


def test_a_pull_with_other_stamps_keeps_what_they_do_not_change(seen, params) -> None:
    pull = pull_of(seen[0], params)
    grasp, release, motion = pull.grasp, pull.release, pull.motion
    seen_late = pull.shifted(camera=0.01)
    assert seen_late.motion is motion and seen_late.release is release
    assert seen_late.recording.depth.stamp[0] == pull.recording.depth.stamp[0] - 10_000_000
    moved = pull.shifted(pose=0.01)
    assert moved.release is release and moved.motion is not motion
    np.testing.assert_allclose(moved.motion.time, motion.time - 0.01, atol=1e-9)
    assert (
        moved.grasp == Pull.of(Part(moved.recording, moved.geometry)).grasp == pytest.approx(grasp)
    )
