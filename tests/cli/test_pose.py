"""The hand's pose for a draw: by hand, by matrices, as the plan has it, as a robot reported it."""

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from pipeline.params import load
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli.plan.plan import plan_recording
from sling2sim2real.cli.pose import posed
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording.frames import EpisodeGeometry, geometry_of
from sling2sim2real.recording.streams import read_recording
from tests.project import DEFAULTS, with_
from validation.recordings.bag import write_bag

pytestmark = pytest.mark.usefixtures("nowhere")

PARAMS = load(DEFAULTS)
RECORDING = "data/raw/band1/band1.mcap"
FORK_IN_BASE = (0.7, 0.1, 0.4, 0.0, 0.0, -(0.5**0.5), 0.5**0.5)  # the target along the base's x
TIPS = np.array([[-0.1375, 0, 0], [0.1375, 0, 0]])


def standing(pose: tuple | None):
    """params.yaml with the fork there in the robot's base."""
    return with_(PARAMS, "setup", base_to_fork=pose)


def at(y: float, z: float, params, root=".") -> dict:
    answer = {"draw_y_m": y, "draw_z_m": z, "hold_force_n": 9.0, "warnings": ["as before"]}
    return posed(answer, params, "band1", root)


UNIT = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1)
PLACE = st.lists(st.floats(-2, 2), min_size=3, max_size=3)


@given(place=PLACE, turn=UNIT, y=st.floats(-2, -0.05), z=st.floats(-2, 1))
def test_band_hand_and_launch_lie_in_one_plane(place, turn, y, z) -> None:
    """In the base, by a homogeneous matrix: all of the band's plane is across the hand's y."""
    turn = np.array(turn) / np.linalg.norm(turn)
    pose = at(y, z, standing((*place, *turn)))
    to_base = np.eye(4)
    to_base[:3, :3], to_base[:3, 3] = Rotation.from_quat(turn).as_matrix(), place

    def in_base(point) -> np.ndarray:
        return (to_base @ [*point, 1.0])[:3]

    quaternion = np.array(pose["tcp_quaternion_xyzw"])
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12) and quaternion[3] >= 0
    axes = Rotation.from_quat(quaternion).as_matrix()
    tcp = np.array(pose["tcp_position_m"])
    np.testing.assert_allclose(tcp, in_base([0, y, z]), atol=1e-6)
    seen = [axes.T @ (in_base(point) - tcp) for point in (*TIPS, np.zeros(3))]
    np.testing.assert_allclose([way[1] for way in seen], 0.0, atol=2e-6)
    left, right, origin = seen
    np.testing.assert_allclose(origin, [0, 0, np.hypot(y, z)], atol=2e-6)  # straight ahead
    np.testing.assert_allclose(right - left, [0.275, 0, 0], atol=1e-9)
    assert (pose["tcp_frame"], pose["hold_force_n"], list(pose)[-1]) == ("base", 9.0, "warnings")
    launch = np.array([0, np.cos(pose["pitch_rad"]), np.sin(pose["pitch_rad"])])
    np.testing.assert_allclose(axes[:, 2], to_base[:3, :3] @ launch, atol=1e-12)


def test_a_half_turn_about_the_approach_axis_as_the_docs_say() -> None:
    """(qy, -qx, qw, -qz) points ahead alike, with the other side up."""
    x, y, z, w = at(-0.3, -0.2, standing(FORK_IN_BASE))["tcp_quaternion_xyzw"]
    axes, turned = (Rotation.from_quat(q).as_matrix() for q in ((x, y, z, w), (y, -x, w, -z)))
    np.testing.assert_allclose(turned, axes * [-1, -1, 1], atol=1e-12)


def test_the_plan_of_a_recording_holds_the_same_draw_alike(tmp_path) -> None:
    """By the CSV that a robot would follow: its pause."""
    params = standing((0.62, -0.05, 0.41, 0.02, -0.03, -0.7, np.sqrt(1 - 0.4913)))
    for draw in ((-0.40, 0.0), (-0.3, -0.25)):
        plan = plan_recording(params, "band1", draw=draw)
        with plan.write(tmp_path, 100.0)[0].open(newline="") as file:
            drawn = next(row for row in csv.DictReader(file) if row["phase"] == "pause")
        pose = at(*draw, params)
        assert pose["tcp_frame"] == plan.frame
        position, turn = ([float(drawn[name]) for name in names.split()] for names in COLUMNS)
        np.testing.assert_allclose(pose["tcp_position_m"], position, atol=1e-6)
        np.testing.assert_allclose(pose["tcp_quaternion_xyzw"], turn, atol=1e-8)


COLUMNS = "x y z", "qx qy qz qw"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(root, truth) of a project with a recording of band1 whose /tf_static joins base and fork.

    Its episode holds no more than the geometry.
    """
    root = tmp_path_factory.mktemp("project")
    (root / "data/raw/band1").mkdir(parents=True)
    path = root / RECORDING
    truth = write_bag(path, cameras=False, rate=200, pose_rate=100)
    recording = read_recording(path, PARAMS.setup)
    retained = EpisodeGeometry.of(recording, geometry_of(recording, PARAMS.setup))
    keep(root, {"geometry": retained.content()})
    return root, truth


def keep(root: Path, metadata: dict) -> None:
    """An episode of band1 that holds no more than this."""
    two, vectors = np.arange(2.0), np.zeros((2, 3))
    signals = (two, vectors, vectors, vectors, two, two, [vectors, vectors])
    Episode("band1", *signals, 0.2, 0.8, np.zeros(3), metadata).save(Layout(root).episode("band1"))


def test_the_recorded_draw_is_the_pose_that_the_robot_reported(recorded) -> None:
    """Before the release, read by another library: same frame, place and turn of the hand."""
    root, truth = recorded
    path = root / RECORDING
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        poses = [message[3] for message in reader.iter_decoded_messages(["/arm/current_pose"])]
    start = poses[0].header.stamp.sec + poses[0].header.stamp.nanosec * 1e-9
    reported = next(
        message
        for message in reversed(poses)
        if message.header.stamp.sec + message.header.stamp.nanosec * 1e-9 - start
        < truth.release - 0.01
    )
    pose = at(-truth.draw, 0.0, standing(None), root)
    assert pose["tcp_frame"] == reported.header.frame_id == "base"
    place, turn = reported.pose.position, reported.pose.orientation
    np.testing.assert_allclose(pose["tcp_position_m"], [place.x, place.y, place.z], atol=1e-6)
    summary = np.array([turn.x, turn.y, turn.z, turn.w])
    assert abs(summary @ pose["tcp_quaternion_xyzw"]) == pytest.approx(1.0, abs=1e-9)
    assert pose["warnings"] == ["as before"]


def test_setup_comes_before_tf_static_and_the_episode_names_the_base(recorded, tmp_path) -> None:
    """As where a recording becomes an episode; without one that has a name, plan.frame does."""
    params = with_(standing(FORK_IN_BASE), "plan", frame="arm")
    poses = [at(-0.3, -0.3, params, root) for root in (recorded[0], tmp_path)]
    keep(tmp_path, {})
    poses.append(at(-0.3, -0.3, params, tmp_path))
    assert [pose["tcp_frame"] for pose in poses] == ["base", "arm", "arm"]
    for pose in poses:
        assert pose["tcp_position_m"] == pytest.approx([0.4, 0.1, 0.1])
        assert pose["warnings"] == ["as before"]


def test_a_base_that_is_not_known_is_one_warning(tmp_path) -> None:
    pose = at(-0.3, -0.3, standing(None), tmp_path)
    assert [pose[name] for name in pose if name.startswith("tcp")] == [None, None, None]
    assert pose["pitch_rad"] == pytest.approx(np.pi / 4)
    before, warning = pose["warnings"][0], pose["warnings"][1].what
    assert before == "as before" and "setup.base_to_fork is null" in warning
    keep(tmp_path, {})
    old = at(-0.3, -0.3, standing(None), tmp_path)
    assert old["tcp_position_m"] is None
    message = old["warnings"][1].what
    assert "older version" in message and "\n" not in message
