"""The hand's pose, and the force, from whatever a lab records of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import kinematics, messages
from sling2sim2real.recording.messages import Topic, Unreadable
from sling2sim2real.recording.topics import _all
from tests.recording.messages import (
    COUNT,
    FORCE,
    PLACES,
    POSES,
    TIMES,
    TURNS,
    assert_poses,
    channel,
    chosen,
    head,
    joints,
    played,
    pose,
    pose_fields,
    wrench,
)


def in_frame(k: int, *poses: dict) -> dict:
    return {"timestamp": head(k)["header"]["stamp"], "frame_id": "base", "poses": [*poses]}


ONE = [pose_fields(values) for values in POSES]
HANDS = {
    "geometry_msgs/PoseStamped": [{**head(k), "pose": ONE[k]} for k in range(COUNT)],
    "geometry_msgs/PoseWithCovarianceStamped": [
        {**head(k), "pose": {"pose": ONE[k], "covariance": []}} for k in range(COUNT)
    ],
    "nav_msgs/Odometry": [
        {**head(k), "child_frame_id": "tcp", "pose": {"pose": ONE[k]}} for k in range(COUNT)
    ],
    "foxglove.PosesInFrame": [in_frame(k, ONE[k]) for k in range(COUNT)],
}


@pytest.mark.parametrize("kind", HANDS)
def test_a_hand_of_each_type(params, kind) -> None:
    choice = chosen(params, wrench("/ft"), channel("/hand", kind, HANDS[kind]))["pose"]
    frame, values = played(choice)
    assert frame == "base"
    assert choice.why == f"the only {choice.topic.kind} for end-effector pose"
    assert_poses(values)
    both = chosen(params, wrench("/ft"), pose("/a"), channel("/ee", kind, HANDS[kind]))
    assert kind == "geometry_msgs/PoseStamped" or both["pose"].topic.name == "/a"


def test_one_of_several_poses_is_not_guessed(params) -> None:
    several = [in_frame(k, ONE[k], ONE[k]) for k in range(COUNT)]
    with pytest.raises(UserError, match="/hand has fewer than two readable messages"):
        chosen(params, wrench("/ft"), channel("/hand", "foxglove.PosesInFrame", several))


def stamped(k: int, parent: str, child: str, values: np.ndarray) -> dict:
    fields = pose_fields(values)
    transform = {"translation": fields["position"], "rotation": fields["orientation"]}
    return {**head(k, parent), "child_frame_id": child, "transform": transform}


def test_a_hand_that_is_in_tf_alone(params) -> None:
    """Over two joints, the first of which turns, and a tool that /tf_static fixes on the hand."""
    first = Rotation.from_rotvec(np.stack([0 * TIMES, 0 * TIMES, 0.5 * TIMES], axis=1))
    place = np.array([0.1, 0.0, 0.2])
    back = first.inv()
    second = np.hstack([back.apply(PLACES - place), (back * TURNS).as_quat()])
    tool = np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0])
    moving = [
        {
            "transforms": [
                stamped(k, "base", "link1", np.append(place, first[k].as_quat())),
                stamped(k, "link1", "hand", second[k]),
            ]
        }
        for k in range(COUNT)
    ]
    still = [{"transforms": [stamped(0, "hand", "hand_tcp", tool)]}]
    topics = [
        channel("/tf", "tf2_msgs/msg/TFMessage", moving),
        channel("/tf_static", "tf2_msgs/msg/TFMessage", still),
    ]
    choice = chosen(params, wrench("/ft"), *topics)["pose"]
    frame, values = played(choice)
    assert frame == "base" and choice.topic.name == "/tf"
    np.testing.assert_allclose(values[:, :3], PLACES + TURNS.apply([0.0, 0.0, 0.1]), atol=1e-9)
    named = chosen(params, wrench("/ft"), *topics, tip_link="link1")["pose"]
    np.testing.assert_allclose(played(named)[1][:, :3], np.tile(place, (COUNT, 1)), atol=1e-9)
    with pytest.raises(UserError, match="/tf moves hand, link1: name the frame of the tool"):
        chosen(params, wrench("/ft"), topics[0])


def test_a_type_is_added_in_one_place(params, monkeypatch) -> None:
    """What is in the table is read, and chosen."""
    sent = HANDS["geometry_msgs/PoseStamped"]
    assert channel("/h", "a/Hand", sent).readings == {}
    monkeypatch.setitem(messages.TYPES, "Hand", {"pose": messages.read_pose})
    assert_poses(played(chosen(params, wrench("/ft"), channel("/h", "a/Hand", sent))["pose"])[1])


def franka(kind: str, frame: str, states: list[dict]) -> Topic:
    return channel("/state", f"franka_msgs/{kind}", [{**head(k, frame), **s} for k, s in states])


def robot_states() -> list:
    """FrankaRobotState, which is of messages with frames of their own."""
    force = {**head(0, "link0"), "wrench": {"force": FORCE}}
    return [
        (k, {"o_f_ext_hat_k": force, "o_t_ee": {**head(0, "link0"), "pose": ONE[k]}})
        for k in range(COUNT)
    ]


def old_states(*names: str) -> list:
    """FrankaState, of column-major matrices and numbers."""
    matrices = np.tile(np.eye(4), (COUNT, 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = TURNS.as_matrix(), PLACES
    return [
        (k, dict(zip(names, (list(matrix.T.ravel()), [1, 2, 3] * 2), strict=True)))
        for k, matrix in enumerate(matrices)
    ]


@pytest.mark.parametrize(
    ("kind", "frame", "states", "base"),
    [
        ("FrankaRobotState", "link0", robot_states(), "link0"),
        ("FrankaState", "", old_states("O_T_EE", "O_F_ext_hat_K"), "franka_base"),
        ("FrankaState", "link0", old_states("o_t_ee", "o_f_ext_hat_k"), "link0"),
    ],
)
def test_a_franka_is_pose_and_for_lack_of_a_sensor_force(params, kind, frame, states, base) -> None:
    state = franka(kind, frame, states)
    roles = chosen(params, state)
    (of_pose, poses), (of_force, forces) = (played(roles[role]) for role in ("pose", "wrench"))
    assert of_pose == of_force == base
    assert_poses(poses)
    np.testing.assert_array_equal(forces, [[1, 2, 3]] * COUNT)
    sensor = wrench("/external_wrench")
    assert chosen(params, state, sensor)["wrench"].topic.name == "/external_wrench"
    named = chosen(params, state, sensor, topics={"wrench": "/state"})["wrench"]
    assert (named.topic.name, named.why) == ("/state", "setup.topics.wrench")


GANTRY = [("x", "prismatic", "1 0 0"), ("y", "prismatic", "0 1 0"), ("z", "prismatic", "0 0 1")]
GANTRY += [(f"r{name}", "revolute", axis) for name, _, axis in reversed(GANTRY)]


GANTRY_URDF = {"urdf": "gantry.urdf"}


@pytest.fixture
def gantry(tmp_path, monkeypatch):
    """Three slides, then turns about z, y and x: its positions are the pose."""
    links = ["bench", "a", "b", "c", "d", "e", "my_tcp"]
    joints = "".join(
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="{axis}"/></joint>'
        for (name, kind, axis), parent, child in zip(GANTRY, links[:-1], links[1:], strict=True)
    )
    (tmp_path / "gantry.urdf").write_text(f'<robot name="gantry">{joints}</robot>')
    monkeypatch.setattr(kinematics, "FOLDER", tmp_path)
    return np.hstack([PLACES, TURNS.as_euler("ZYX")])


def test_joint_states_through_a_urdf(params, gantry) -> None:
    """In another order, among others, and beside the gripper's."""
    names = ["finger_joint1", *(name for name, *_ in reversed(GANTRY))]
    positions = np.hstack([np.full((COUNT, 1), 0.02), gantry[:, ::-1]])
    arm = joints("/joint_states", names, positions)
    gripper = joints("/gripper/joint_states", ["finger_joint1"], gantry[:, :1])
    roles = chosen(params, wrench("/ft"), gripper, arm, urdf="gantry.urdf")
    frame, values = played(roles["pose"])
    assert frame == "bench" and roles["pose"].topic.name == "/joint_states"
    assert_poses(values)
    assert roles["gripper"].topic.name == "/gripper/joint_states"

    alone = chosen(params, wrench("/ft"), arm, urdf="gantry.urdf")
    np.testing.assert_array_equal(played(alone["gripper"])[1], [[0.02]] * COUNT)
    measured = chosen(params, wrench("/ft"), arm, pose(), urdf="gantry.urdf")
    assert measured["pose"].topic.name == "/arm/current_pose"


def test_arm_and_gripper_that_share_a_topic(params, gantry) -> None:
    """Each is read from its own messages; one that lacks some of its joints is damaged."""
    arm = joints("/joint_states", [name for name, *_ in GANTRY], gantry)
    fingers = joints("/joint_states", ["left_finger", "right_finger"], gantry[:, :2])
    shared = replace(arm, log_times=[], readings={"joints": []})
    for one in zip(*(_all(topic, "joints") for topic in (fingers, arm)), strict=True):
        for time, reading in one:
            shared.log_times.append(time)
            shared.readings["joints"].append(reading)
    shared.readings["joints"][0].value.pop("left_finger")
    roles = chosen(params, wrench("/ft"), shared, urdf="gantry.urdf")
    pose, gripper = (roles[role].messages for role in ("pose", "gripper"))
    assert len(pose) == len(gripper) == COUNT and len(pose[0][1].value) == 6
    assert sorted(gripper[1][1].value) == sorted(gantry[1, :2])
    assert isinstance(gripper[0][1], Unreadable) and gripper[0][1] == "joint left_finger is missing"


@pytest.mark.parametrize(
    ("channel", "setup", "words"),
    [
        (joints("/js", ["j1", "j2"], PLACES[:, :2]), {}, "joints j1, j2: put the robot's URDF"),
        (joints("/js", ["x", "y"], PLACES[:, :2]), GANTRY_URDF, "/js lacks joint z, rz, ry, rx of"),
        (joints("/js", ["finger"], PLACES[:, :1]), {}, "/js has the joints of fingers alone"),
        (joints("/js", ["x"], PLACES[:, :1]), {"urdf": "no.urdf"}, "no.urdf: cannot be read"),
    ],
)
def test_a_missing_pose_says_what_would_do(params, gantry, channel, setup, words) -> None:
    with pytest.raises(UserError, match=words) as caught:
        chosen(params, wrench("/ft"), channel, **setup)
    text = str(caught.value)
    assert text.startswith("no end-effector pose") and "\n" not in text
