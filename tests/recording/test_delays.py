"""Delays that were put in are found; none is made up where there is none."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.recording import delays, images
from sling2sim2real.recording.camera_delay import camera_delay
from sling2sim2real.recording.checks import of_release
from sling2sim2real.recording.delays import Estimate, correct_delays
from sling2sim2real.recording.events import Part, Pull
from sling2sim2real.recording.force import ToolInertia, estimate_tool_inertia
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.messages import Picture
from sling2sim2real.recording.release_pictures import ReleasePictures, release_pictures
from sling2sim2real.recording.start_back import start_back
from sling2sim2real.recording.streams import read_recording
from tests.project import with_
from tests.recording.conftest import pull_of
from tests.recording.played import Played
from validation.recordings.bag import Truth

SLOW = Truth(grasp=0.9, lifted=1.4, drawn=2.8, release=3.4, end=4.6)
INJECTED = (-0.02, 0.0, 0.005, 0.015)  # s


def pulled(*given) -> Pull:
    """Of a recording and its geometry, as if it were one pull."""
    return Pull.of(Part(*given))


def late(recording, role: str, seconds: float):
    """With the stamps of one topic late."""
    stream = getattr(recording, role)
    return replaced(recording, **{role: replace(stream, stamp=stream.stamp + round(seconds * 1e9))})


def replaced(recording, **streams):
    if isinstance(recording, SimpleNamespace):
        return SimpleNamespace(**{**vars(recording), **streams})
    return replace(recording, **streams)


@pytest.fixture(scope="module")
def heavy():
    """A recording in which the hand comes and goes, and the sensor feels it."""
    played = Played(mass=0.7, truth=replace(SLOW, noise=0.0))
    return played.recording(), played.geometry()


@pytest.mark.parametrize("noise", [0.02, 0.1])
def test_the_poses_delay_is_found_by_the_tools_inertia(heavy, noise) -> None:
    """With an error that is true: 20 recordings of other noise."""
    recording, geometry = heavy
    off, errors = [], []
    for seed in range(20):
        wrench = recording.wrench
        shaken = np.random.default_rng(seed).normal(0, noise, wrench.values.shape)
        changed = replaced(recording, wrench=replace(wrench, values=wrench.values + shaken))
        seconds = INJECTED[seed % 4]
        inertia = estimate_tool_inertia(pulled(late(changed, "pose", seconds), geometry), None)
        off.append(inertia.delay - seconds)
        errors.append(inertia.delay_error)
        assert inertia.mass == pytest.approx(0.7, abs=5 * inertia.mass_error)
    assert np.abs(off).max() <= 0.05 * noise  # s for each newton
    assert 0.5 < np.sqrt(np.mean((np.array(off) / errors) ** 2)) < 1.5


@pytest.mark.parametrize("share", [0.0, 0.2])
def test_a_slow_pose_that_loses_messages_makes_no_delay_up(heavy, share) -> None:
    """At 33 Hz, or with every fifth message missing: what is found is true within its error."""
    recording, geometry = heavy
    for seed in range(6):
        random = np.random.default_rng(seed)
        pose = recording.pose
        keep = np.arange(seed, len(pose.stamp), 15)
        keep = keep[random.random(len(keep)) >= share]
        fewer = replace(pose, stamp=pose.stamp[keep], values=pose.values[keep])
        changed = replaced(recording, pose=fewer)
        inertia = estimate_tool_inertia(
            pulled(late(changed, "pose", INJECTED[seed % 4]), geometry), None
        )
        if inertia is None:
            continue
        off = inertia.delay - INJECTED[seed % 4]
        assert abs(off) < 0.002 or abs(off) < 3 * inertia.delay_error


def test_a_force_that_does_not_feel_the_tool_says_nothing_of_the_pose() -> None:
    for mass, noise in ((0.0, SLOW.noise), (0.005, 1e-4)):  # a cable of 5 g is no tool either
        played = Played(mass=mass, truth=replace(SLOW, noise=noise))
        for seconds in INJECTED:
            recording = late(played.recording(), "pose", seconds)
            assert estimate_tool_inertia(pulled(recording, played.geometry()), None) is None


@pytest.fixture(scope="module")
def looked_at(seen, params):
    recording = read_recording(seen[0], params.setup)
    return recording, geometry_of(recording, params.setup)


@pytest.mark.parametrize("seconds", [-0.25, *INJECTED, 0.3])
def test_the_cameras_delay_is_found_by_the_hand_in_its_pictures(looked_at, params, seconds) -> None:
    recording, geometry = looked_at
    changed = late(late(recording, "depth", seconds), "color", seconds)
    estimate = correct_delays(pulled(changed, geometry), params)[1].camera
    assert estimate.against == "pose" and estimate.left < 0.001
    assert abs(estimate.value - seconds) <= 0.001


def test_wrong_extrinsics_are_no_delay(looked_at) -> None:
    """A camera that is 3 mm and half a degree elsewhere."""
    from scipy.spatial.transform import Rotation

    from sling2sim2real.recording.transforms import Transform

    recording, geometry = looked_at
    off = Transform(Rotation.from_rotvec([0.006, -0.004, 0.005]), np.array([0.002, 0.002, -0.001]))
    value, _ = camera_delay(pulled(recording, replace(geometry, camera=off @ geometry.camera)))
    assert abs(value) <= 0.0015


def test_black_pictures_say_nothing(blind, params) -> None:
    recording = read_recording(blind[0], params.setup)
    assert camera_delay(pull_of(recording, params)) is None


def test_what_is_applied(looked_at, params) -> None:
    recording, geometry = looked_at
    pull = pulled(recording, geometry)
    right, estimates = correct_delays(pull, params)
    assert abs(estimates.pose.value) < 0.001 and not estimates.pose.applied  # the hand starts back
    assert abs(estimates.camera.value) < 0.001 and estimates.camera.applied
    off = (right.recording.depth.stamp - recording.depth.stamp) * 1e-9
    np.testing.assert_allclose(off, -estimates.camera.value, atol=1e-9)

    right, estimates = correct_delays(pulled(late(recording, "depth", 0.015), geometry), params)
    assert estimates.camera.applied and estimates.camera.value == pytest.approx(0.015, abs=0.001)
    right = right.recording
    np.testing.assert_allclose((right.depth.stamp - recording.depth.stamp) * 1e-9, 0, atol=1e-3)


@pytest.mark.parametrize("seconds", [-0.03, -0.01, 0.012, 0.03])
def test_a_late_force_looks_like_a_pose_that_is_early(looked_at, params, seconds) -> None:
    """The hand starts back before the force falls: said, and taken out where pictures confirm it.

    Those of the release show it or not: they are 67 ms apart.
    """
    recording, geometry = looked_at
    changed = replace(late(recording, "wrench", seconds), start=recording.origin)
    right, estimates = correct_delays(pulled(changed, geometry), params)
    pose = estimates.pose
    assert pose.value == pytest.approx(-seconds, abs=0.002) and not estimates.conflict
    assert pose.alone != pose.applied
    assert pose.left == pytest.approx(pose.error if pose.applied else abs(pose.value), rel=0.01)
    moved = (right.recording.pose.stamp - recording.pose.stamp) * 1e-9
    np.testing.assert_allclose(moved, -pose.rest, atol=1e-9)


@pytest.mark.parametrize(("back", "conflict"), [(0.001, False), (0.02, True)])
def test_two_estimates_are_weighed_or_said(looked_at, params, monkeypatch, back, conflict) -> None:
    """Neither is used where the two do not agree: any of both may be left."""
    tool = ToolInertia(1.0, 0.01, 0.0, 0.001)
    monkeypatch.setattr(delays, "estimate_tool_inertia", lambda *_: tool)
    monkeypatch.setattr(delays, "start_back", lambda _: (back, 0.001))
    estimates = correct_delays(pulled(*looked_at), params)[1]
    assert bool(estimates.conflict) == conflict and not estimates.pose.applied
    assert estimates.pose.value == pytest.approx(0.0 if conflict else back / 2)
    assert estimates.pose.left == pytest.approx(0.001 * np.sqrt(1.0 if conflict else 0.75))
    assert estimates.pose.alone == conflict


def given(params, **delays):
    return with_(params, "episode.delays", **delays)


def test_given_delays_that_are_right_are_kept(looked_at, params) -> None:
    """To the digit, with an error of their own where nothing ties them better."""
    recording, geometry = looked_at
    changed = late(late(recording, "pose", -0.012), "depth", 0.3)
    summary = given(params, pose=-0.012, camera=0.3)
    right, estimates = correct_delays(pulled(late(changed, "color", 0.3), geometry), summary)
    assert (estimates.pose.value, estimates.camera.value) == (-0.012, 0.3)
    assert estimates.pose.source == estimates.camera.source == "setup" and not estimates.conflict
    assert 0 < estimates.pose.left < 0.003 and 0 < estimates.camera.left < 0.002
    for role in ("pose", "depth", "color"):
        assert np.all(getattr(right.recording, role).stamp == getattr(recording, role).stamp)


def test_a_given_delay_that_the_recording_does_not_show(looked_at, params, monkeypatch) -> None:
    """It has the error of a given number, and is taken off."""
    for name in ("camera_delay", "start_back", "release_pictures"):
        monkeypatch.setattr(delays, name, lambda *_: None)
    _, estimates = correct_delays(pulled(*looked_at), given(params, pose=-0.004, camera=0.0))
    assert estimates.pose == Estimate(-0.004, 0.002, "setup", True, 0.002, given=-0.004)
    assert estimates.camera == Estimate(0.0, 0.005, "setup", False, 0.005, given=0.0)


@pytest.mark.parametrize("summary", [0.0, 0.03])
def test_a_given_delay_that_is_wrong_is_put_right(looked_at, params, summary) -> None:
    """The camera is 12 ms late, whatever was given."""
    recording, geometry = looked_at
    pull = pulled(late(late(recording, "depth", 0.012), "color", 0.012), geometry)
    right, estimates = correct_delays(pull, given(params, camera=summary))
    assert estimates.camera.value == pytest.approx(0.012, abs=0.001) and estimates.camera.applied
    assert estimates.camera.rest == pytest.approx(0.012 - summary, abs=0.001)
    assert estimates.camera.left < 0.002
    off = (right.recording.depth.stamp - recording.depth.stamp) * 1e-9
    np.testing.assert_allclose(off, 0, atol=1e-3)


def test_a_given_delay_tells_a_clock_from_the_robots_own_motion(looked_at, params) -> None:
    recording, geometry = looked_at
    early = pulled(late(recording, "pose", 0.02), geometry)
    _, estimates = correct_delays(early, given(params, pose=0.0))
    assert estimates.pose.value == 0.0 and estimates.pose.left == 0.002
    assert "moves by itself" in estimates.conflict
    _, estimates = correct_delays(early, given(params, pose=0.015))
    assert estimates.pose.value == pytest.approx(0.02, abs=0.002) and not estimates.conflict


@pytest.mark.parametrize(
    ("window", "late_start", "alone"),
    [((-0.01, 0.035), False, True), ((-0.01, 0.015), True, False), ((0.01, 0.035), False, False)],
)
def test_the_camera_tells_a_late_pose_from_a_late_start(
    looked_at, params, monkeypatch, window, late_start, alone
) -> None:
    """The hand starts 20 ms late: by its pictures as the pose says, by those of the release not.

    Args:
        window: Of the camera's delay against the force, as the pictures of the release show it.
        late_start: Whether the robot started so by itself.
        alone: Whether both are possible.
    """

    def pictures(pull: Pull, _):
        taken = (looked_at[0].depth.stamp[0] - pull.recording.depth.stamp[0]) * 1e-9
        low, high = (bound - taken for bound in window)
        return ReleasePictures(low, high, low + 0.015, high, (), ())

    def by_hand(pull: Pull):
        """The camera goes with the pose that was recorded."""
        taken = [
            (getattr(looked_at[0], role).stamp[0] - getattr(pull.recording, role).stamp[0]) * 1e-9
            for role in ("pose", "depth")
        ]
        return taken[0] - taken[1], 0.0005

    monkeypatch.setattr(delays, "start_back", lambda _: (0.02, 0.001))
    monkeypatch.setattr(delays, "camera_delay", by_hand)
    monkeypatch.setattr(delays, "release_pictures", pictures)
    _, estimates = correct_delays(pulled(*looked_at), params)
    clock = not (late_start or alone)
    assert estimates.pose.applied == clock and estimates.pose.alone == alone
    assert estimates.camera.value == pytest.approx(0.02 if clock else 0.0)
    left = 0.003 if late_start else 0.001 if clock else 0.02
    assert estimates.pose.left == pytest.approx(left, rel=0.01) and not estimates.conflict


def test_a_hand_and_a_band_that_disagree_are_left_and_said(looked_at, params, monkeypatch) -> None:
    """By the hand the camera is 40 ms late; but so the band is let go 0.2 s after the force."""
    late = ReleasePictures(0.19, 0.21, 0.205, 0.21, (), ())
    monkeypatch.setattr(delays, "release_pictures", lambda *_: late)
    monkeypatch.setattr(delays, "camera_delay", lambda _: (0.04 - late.middle, 0.0005))
    recording, geometry = looked_at
    right, estimates = correct_delays(pulled(recording, geometry), params)
    assert "but the band is let go +200" in estimates.conflict
    assert not estimates.camera.applied and estimates.camera.left == pytest.approx(0.24, rel=0.01)
    np.testing.assert_array_equal(right.recording.depth.stamp, recording.depth.stamp)


RELEASE = 3.0
TIME = np.arange(0.0, 4.0, 0.002)


def handed(away: np.ndarray) -> SimpleNamespace:
    """A hand 0.4 m behind the fork that is `away` (S,) from there at TIME [m]."""
    path = np.stack([0 * away, -0.4 - away, 0 * away], axis=1)
    motion = SimpleNamespace(
        time=TIME, path=path, period=0.002, position=lambda time: np.array([0.0, -0.4, 0.0])
    )
    release = SimpleNamespace(time=RELEASE, fall=0.0007, resolution=0.001)
    return SimpleNamespace(release=release, motion=motion)


def swing(begin: float) -> np.ndarray:
    """A 5 kg arm on 12 kN/m, which 15 N let go; half its critical damping [m]."""
    since, rate = np.clip(TIME - begin, 0, None), np.sqrt(12000 / 5)
    turn = rate * np.sqrt(0.75)
    rest = np.cos(turn * since) + 0.5 / np.sqrt(0.75) * np.sin(turn * since)
    return 15 / 12000 * (1 - np.exp(-0.5 * rate * since) * rest)


def retreat(begin: float) -> np.ndarray:
    return 0.13 * np.clip(TIME - begin, 0, None)


@pytest.mark.parametrize("moves", [swing, retreat])
@pytest.mark.parametrize("late", [-0.03, -0.005, 0.0, 0.012, 0.03])
def test_the_poses_delay_is_found_with_a_true_error(moves, late) -> None:
    off, errors = [], []
    for seed in range(8):
        shaken = np.random.default_rng(seed).normal(0, 4e-6, len(TIME))
        value, error = start_back(handed(moves(RELEASE + late) + shaken))
        off.append(value - late)
        errors.append(error)
    assert np.abs(off).max() < 0.002
    assert np.sqrt(np.mean((np.array(off) / errors) ** 2)) < 1.5


def test_a_hand_that_rests_or_wanders_says_nothing() -> None:
    random = np.random.default_rng(1)
    assert start_back(handed(random.normal(0, 2e-5, len(TIME)))) is None
    assert start_back(handed(1e-4 * np.sin(2 * TIME))) is None
    assert start_back(handed(retreat(RELEASE + 0.5))) is None
    assert start_back(handed(-retreat(RELEASE))) is None  # towards the fork


SOUND = ReleasePictures(-0.03, 0.02, -0.015, 0.02, (), ())


@pytest.fixture(scope="module")
def pull(seen, params) -> Pull:
    return pull_of(seen[0], params)


@pytest.mark.parametrize("late", [-0.2, -0.06, 0.0, 0.06, 0.2])
def test_the_delay_is_between_both_ends(pull, params, late) -> None:
    pictures = release_pictures(pull.shifted(camera=-late), params.setup.fork_width)
    assert pictures.earliest <= late <= pictures.latest
    assert pictures.latest - pictures.earliest < 1.3 * pull.recording.depth.period + 0.02
    if abs(late) < 0.001:
        assert pictures.beyond == 0
        assert not list(of_release(replace(pictures, repeated=())))
    if abs(late) > 0.1:
        assert pictures.beyond > 0
        assert [finding.about for finding in of_release(pictures)][-1:] == ["release_pictures"]


def test_what_the_pictures_show_goes_before_the_hand(pull, params) -> None:
    """A camera that is 0.2 s late is nearly right after the correction, or said to be unclear."""
    moved, estimates = correct_delays(pull.shifted(camera=-0.2), params)
    left = (moved.recording.depth.stamp - pull.recording.depth.stamp) * 1e-9
    assert abs(left).max() < 3 * (estimates.camera.left or 0.0) + 1e-9
    assert estimates.camera.applied


def test_black_pictures_show_nothing(blind, params) -> None:
    dark = pull_of(blind[0], params)
    assert release_pictures(dark, params.setup.fork_width) is None


@pytest.mark.fires("release_pictures")
def test_old_pictures_over_the_release_are_refused() -> None:
    held = replace(SOUND, repeated=(-0.2, -0.1, -0.015))  # of a scene without noise
    assert not list(of_release(held))
    for odd in (
        replace(SOUND, repeated=(0.053,)),
        replace(SOUND, repeated=(0.01,)),
        replace(SOUND, drawn=0.2, gone=0.23, earliest=0.18, latest=0.23, repeated=(0.1, 0.2)),
    ):
        (message,) = of_release(odd)
        assert message.about == "release_pictures" and message.refused


def test_pictures_without_depth_or_in_disorder_make_no_delay_up(pull, params) -> None:
    """Of an emitter that is switched on and off every second one is empty."""
    depth = pull.recording.depth
    nothing = np.zeros_like(images.depth(depth.values[0]))
    blank = Picture("32FC1", "", nothing.view(np.uint8).ravel(), *nothing.shape, nothing.strides[0])
    values = [blank if k % 2 else picture for k, picture in enumerate(depth.values)]
    flickers = replace(pull.recording, depth=replace(depth, values=values))
    pictures = release_pictures(replace(pull, recording=flickers), params.setup.fork_width)
    assert pictures.earliest <= 0 <= pictures.latest and not pictures.again
    assert replace(SOUND, drawn=-0.3, gone=-0.27, latest=-0.27, again=(-0.2,)).beyond == 0


def test_a_band_that_is_never_let_go_is_refused(pull, params) -> None:
    depth = pull.recording.depth
    since = depth.seconds(pull.recording.origin) - pull.release.time
    held = depth.values[int(np.searchsorted(since, -0.1))]
    values = [
        held if time > -0.1 else picture for time, picture in zip(since, depth.values, strict=True)
    ]
    frozen = replace(pull.recording, depth=replace(depth, values=values))
    pictures = release_pictures(replace(pull, recording=frozen), params.setup.fork_width)
    assert pictures.never and pictures.beyond == 0 and pictures.frozen
    for case in (pictures, replace(pictures, repeated=())):
        (message,) = of_release(case)
        assert message.refused


@pytest.mark.fires("release_pictures")
def test_impossible_pictures_are_said() -> None:
    late = replace(SOUND, drawn=0.06, gone=0.09, earliest=0.045, latest=0.09)
    again = replace(SOUND, again=(0.15,))
    message = [finding.about for odd in (late, again) for finding in of_release(odd)]
    assert message == ["release_pictures", "release_pictures"]
    assert not list(of_release(SOUND)) and np.isclose(SOUND.error, 0.05 / np.sqrt(12))
