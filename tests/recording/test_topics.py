"""Choosing among topics, of whatever a lab records, and saying what lacks."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.records import Schema
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import kinematics, messages
from sling2sim2real.recording.files import Container
from sling2sim2real.recording.messages import Reading, Topic, Unreadable
from sling2sim2real.recording.topics import Choice, _all, camera_of, choose, transforms_of

COUNT, RATE = 200, 100.0
TIMES = np.arange(COUNT) / RATE
PLACES = np.stack([0.3 + 0.1 * np.sin(TIMES), 0.2 * TIMES, 0.4 - 0.1 * TIMES**2], axis=1)
TURNS = Rotation.from_rotvec(np.stack([0.3 * TIMES, np.sin(TIMES), 2 + 0 * TIMES], axis=1))
POSES = np.hstack([PLACES, TURNS.as_quat()])
FORCE = {"x": 1.0, "y": 2.0, "z": 3.0}


def head(k: int, frame: str = "base") -> dict:
    return {"header": {"stamp": {"sec": 5, "nanosec": round(1e9 * TIMES[k])}, "frame_id": frame}}


def pose_fields(pose: np.ndarray) -> dict:
    position = dict(zip("xyz", pose[:3], strict=True))
    return {"position": position, "orientation": dict(zip("xyzw", pose[3:], strict=True))}


ONE = [pose_fields(values) for values in POSES]


def channel(
    name: str, kind: str, bodies: list[dict], rate: float = RATE, frame: str = "base"
) -> Topic:
    """Messages without their headers."""
    topic = Topic.of(name, Schema(1, b"{}", "jsonschema", kind), "json")
    for k, body in enumerate(bodies):
        message = json.dumps({**head(k, frame), **body}).encode()
        topic.add(5_000_000_000 + round(1e9 * k / rate), message)
    return topic


def wrench(topic: str, rate: float = 1000.0, count: int = COUNT) -> Topic:
    bodies = [{"wrench": {"force": FORCE}}] * count
    return channel(topic, "geometry_msgs/WrenchStamped", bodies, rate, "sensor")


def pose(topic: str = "/arm/current_pose", rate: float = RATE) -> Topic:
    return channel(topic, "geometry_msgs/msg/PoseStamped", [{"pose": one} for one in ONE], rate)


def joints(topic: str, names: list[str], positions: np.ndarray) -> Topic:
    bodies = [{"name": names, "position": list(row)} for row in positions]
    return channel(topic, "sensor_msgs/msg/JointState", bodies, frame="")


def picture(topic: str, encoding: str, frame: str, width: int = 4, height: int = 2) -> Topic:
    step = width * {"rgb8": 3, "bayer_rggb8": 1, "16UC1": 2, "mono8": 1}[encoding]
    body = {"height": height, "width": width, "step": step, "encoding": encoding}
    body["data"] = [0] * (step * height)
    return channel(topic, "sensor_msgs/msg/Image", [body] * 3, 30, frame)


def info(topic: str, frame: str, focal: float = 50.0, width: int = 4, height: int = 2) -> Topic:
    k = [focal, 0, 2, 0, focal, 1, 0, 0, 1]
    body = {"width": width, "height": height, "k": k, "d": [], "p": [], "distortion_model": ""}
    return channel(topic, "sensor_msgs/msg/CameraInfo", [body] * 2, 30, frame)


CAMERA = (
    picture("/cam/color/image", "rgb8", "color"),
    info("/cam/color/camera_info", "color"),
    picture("/cam/depth/image", "16UC1", "depth"),
    info("/cam/depth/camera_info", "depth", 40.0),
)


def chosen(params, *topics_: Topic, camera=CAMERA, topics=(), **setup: object):
    given = {**setup, "topics": params.setup.topics.model_copy(update=dict(topics))}
    file = Container(Path("f.mcap"), [*topics_, *camera])
    return choose(file, params.setup.model_copy(update=given))


def played(choice: Choice) -> tuple[str, np.ndarray]:
    """Frame, and what the reader makes of a topic."""
    samples = [sample for _, sample in choice.messages if isinstance(sample, Reading)]
    assert len(samples) == len(choice.messages)
    stamps = np.array([sample.stamp for sample in samples])
    np.testing.assert_array_equal(stamps, 5_000_000_000 + np.round(1e9 * TIMES))
    values = np.array([sample.value for sample in samples])
    return samples[0].frame, choice.convert(values) if choice.convert else values


def assert_poses(poses: np.ndarray, atol: float = 1e-9) -> None:
    np.testing.assert_allclose(poses[:, :3], POSES[:, :3], atol=atol)
    off = (Rotation.from_quat(poses[:, 3:]).inv() * TURNS).magnitude()
    assert off.max() < max(atol, 1e-7)


COLOR, COLOR_INFO, DEPTH, DEPTH_INFO = CAMERA
FLAT = picture("/cam/color", "rgb8", "color"), picture("/cam/depth", "16UC1", "depth")


def test_the_measured_one_of_several(params) -> None:
    roles = chosen(
        params,
        wrench("/command/wrench"),
        wrench("/arm/external_wrench"),
        wrench("/ft_sensor/wrench"),
        wrench("/battery/ft_force", rate=1.0, count=190),
        pose("/arm/target_pose"),
        pose("/camera/ee_pose"),
        pose("/arm/ee_pose"),
        pose("/object"),
    )
    assert roles["wrench"].topic.name == "/ft_sensor/wrench"
    assert roles["wrench"].why == (
        "at 1000 Hz; not /arm/external_wrench, /battery/ft_force and 1 more"
    )
    assert roles["pose"].topic.name == "/arm/ee_pose"
    assert roles["color"].why == "the only Image for colour images"
    assert list(roles) == ["wrench", "pose", "color", "depth", "color_info", "depth_info"]


def test_where_several_topics_would_do_one_line_lists_them(params) -> None:
    """Also of two arms: who pulled the band is not guessed; what is named is taken."""
    arms = [
        make(f"/{side}/{make.__name__}") for side in ("left", "right") for make in (wrench, pose)
    ]
    words = (
        "several topics would do: setup.topics.wrench /left/wrench, /right/wrench;"
        " setup.topics.pose /left/pose, /right/pose: name those that are meant in params.yaml"
    )
    with pytest.raises(UserError) as caught:
        chosen(params, *arms)
    assert str(caught.value) == words
    topics = {"wrench": "/right/wrench", "pose": "/right/pose"}
    roles = chosen(params, *arms, topics=topics)
    assert {role: roles[role].topic.name for role in topics} == topics
    webcam = picture("/webcam/rgb", "rgb8", "webcam"), info("/webcam/camera_info", "webcam")
    one_arm = wrench("/ft"), pose()
    with pytest.raises(UserError, match="setup.topics.color /cam/color/image, /webcam/rgb: name"):
        chosen(params, *one_arm, *webcam)
    packed = replace(CAMERA[0], name="/cam/color/image/compressed")  # one picture, sent twice
    assert "color" in chosen(params, *one_arm, packed)


def test_fingers_of_any_sign_and_of_two_hands(params) -> None:
    closing = 0.04 - 0.03 * (TIMES > 1.0)
    other = 0.04 - 0.035 * (TIMES > 0.5)
    for positions, wanted in (
        ({"left_finger": closing, "right_finger": closing}, 2 * closing),
        ({"left_finger": closing, "right_finger": -closing}, 2 * closing),
        ({"a_finger": closing, "b_finger": 0 * TIMES}, closing),
        ({"joint1": other, "finger_joint": closing}, closing),
        ({"finger": 0 * TIMES}, 0 * TIMES),
    ):
        fingers = joints("/joints", list(positions), np.stack([*positions.values()], axis=1))
        roles = chosen(params, wrench("/ft"), pose(), fingers)
        np.testing.assert_allclose(played(roles["gripper"])[1][:, 0], wanted)
    hands = joints("/joints", ["a_finger", "b_finger"], np.stack([closing, other], axis=1))
    choice = chosen(params, wrench("/ft"), pose(), hands)["gripper"]
    with pytest.raises(UserError, match="/joints: the joints a_finger, b_finger do not move as"):
        played(choice)


def test_the_topics_of_a_realsense(params) -> None:
    """Registered depth before the camera's own, colour before infrared."""
    camera = [
        made
        for name, encoding, frame in (
            ("color", "rgb8", "color"),
            ("aligned_depth_to_color", "16UC1", "color"),
            ("depth", "16UC1", "d"),
            ("infra1", "mono8", "d"),
        )
        for made in (
            picture(f"/cam/{name}/image_raw", encoding, frame),
            info(f"/cam/{name}/camera_info", frame),
        )
    ]
    roles = chosen(params, wrench("/ft300/wrench"), pose(), camera=camera)
    names = [roles[role].topic.name for role in ("color", "color_info", "depth", "depth_info")]
    assert names == [
        f"/cam/{name}/{what}"
        for name in ("color", "aligned_depth_to_color")
        for what in ("image_raw", "camera_info")
    ]


# Camera infos


def cameras(params, *channels: Topic, **topics: str):
    roles = chosen(params, wrench("/ft"), pose(), camera=channels, topics=topics)
    focals = [camera_of(roles, role).matrix[0, 0] for role in ("color", "depth")]
    return roles, focals


def test_each_camera_has_its_own_info(params) -> None:
    assert cameras(params, *CAMERA)[1] == cameras(params, *reversed(CAMERA))[1] == [50, 40]
    away = info("/calibration/depth", "depth", 30.0)  # elsewhere, but of that frame and size
    roles, focals = cameras(params, *CAMERA[:3], away)
    assert focals == [50, 30]
    assert roles["depth_info"].why == "of the frame and size of /cam/depth/image"
    assert roles["color_info"].why == "beside /cam/color/image"
    infos = info("/cam/color_info", "color"), info("/cam/depth_info", "depth", 40.0)
    assert cameras(params, *FLAT, *infos)[1] == [50, 40]


def test_a_damaged_first_message_does_not_decide(params) -> None:
    first, *others = DEPTH.readings["picture"]
    first = first._replace(value=replace(first.value, encoding="16QC1"))
    bad_depth = replace(DEPTH, readings={"picture": [first, *others]})
    assert cameras(params, COLOR, COLOR_INFO, bad_depth, DEPTH_INFO)[1] == [50, 40]


def test_registered_depth_may_use_the_colour_cameras(params) -> None:
    depth = picture("/cam/aligned/image", "16UC1", "color")
    roles, focals = cameras(params, COLOR, COLOR_INFO, depth)
    assert focals == [50, 50]
    assert roles["depth_info"].why == "of the frame and size of /cam/aligned/image"
    roles, _ = cameras(params, *CAMERA[:3], depth_info="/cam/color/camera_info")
    assert roles["depth_info"].why == "setup.topics.depth_info"  # who says so is believed


@pytest.mark.parametrize(
    "camera",
    [
        (COLOR, COLOR_INFO, DEPTH),
        (COLOR, COLOR_INFO, picture("/cam/depth/image", "16UC1", "color", 8, 4)),
        (*FLAT, info("/cam/camera_info", "color")),
        (COLOR, info("/cam/color/camera_info", ""), DEPTH),  # frames without names
        (COLOR, COLOR_INFO, picture("/cam/depth/image", "16UC1", "")),
    ],
)
def test_unregistered_depth_must_not_use_the_colour_cameras(params, camera) -> None:
    with pytest.raises(UserError, match="no camera info of the depth.* is of frame .* pixels, /"):
        cameras(params, *camera)


# What lacks


BAYER = picture("/cam/color/bayer", "bayer_rggb8", "color")


@pytest.mark.parametrize(
    ("topics", "words"),
    [
        ({"wrench": "/none"}, "is /none; the file has /arm/current_pose"),
        ({"pose": "/ft"}, "is /ft; .*/ft .Wrench.* none of a type that is read for it .PoseSt"),
        ({"pose": "/js"}, "is /js; /js has the joints j1, j2, j3: put the robot's URDF"),
        ({"depth": "/cam/color/image"}, "/cam/color/image: .*'rgb8'"),
        ({"color": "/cam/color/bayer"}, "/cam/color/bayer: .*'bayer_rggb8'"),
        ({"color_info": "/ft"}, "read for it .CameraInfo, CameraCalibration"),
    ],
)
def test_named_topics_that_will_not_do(params, topics, words) -> None:
    arm = joints("/js", ["j1", "j2", "j3"], PLACES)
    some = wrench("/ft"), pose(), arm
    with pytest.raises(UserError, match=words) as caught:
        chosen(params, *some, camera=[BAYER, *CAMERA], topics=topics)
    text = str(caught.value)
    assert text.startswith(f"setup.topics.{next(iter(topics))} is ") and "\n" not in text
    assert chosen(params, *some, camera=[BAYER, *CAMERA])["color"].topic.name == "/cam/color/image"
    with pytest.raises(UserError, match="no colour images.*/cam/color/bayer.*'bayer_rggb8'"):
        chosen(params, *some, camera=[BAYER, *CAMERA[1:]])


@pytest.mark.parametrize(
    ("schema", "encoding", "words"),
    [
        (Schema(0, b"", "", ""), "json", "the file has .*/ft .json topic without a schema"),
        (
            Schema(1, b"", "flatbuffer", "lab.WrenchStamped"),
            "flatbuffer",
            "topic /ft: .*flatbuffer",
        ),
    ],
)
def test_a_topic_that_cannot_be_read_is_named_if_nothing_else_will_do(
    params, schema, encoding, words
) -> None:
    other = Topic.of("/ft", schema, encoding)
    other.add(1, b"{}")
    for topics, what in (({}, "no force"), ({"wrench": "/ft"}, "setup.topics.wrench is /ft")):
        with pytest.raises(UserError, match=f"{what}.*{words}"):
            chosen(params, other, pose(), topics=topics)
    assert chosen(params, other, wrench("/ft2"), pose())["wrench"].topic.name == "/ft2"


HANDS = {
    "geometry_msgs/PoseStamped": [{"pose": one} for one in ONE],
    "geometry_msgs/PoseWithCovarianceStamped": [{"pose": {"pose": one}} for one in ONE],
    "nav_msgs/Odometry": [{"child_frame_id": "tcp", "pose": {"pose": one}} for one in ONE],
    "foxglove.PosesInFrame": [{"poses": [one]} for one in ONE],
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
    several = [{"poses": [one, one]} for one in ONE]
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
    links = np.hstack([np.tile(place, (COUNT, 1)), first.as_quat()])
    moving = [
        {"transforms": [stamped(k, "base", "link1", a), stamped(k, "link1", "hand", b)]}
        for k, (a, b) in enumerate(zip(links, second, strict=True))
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


MATRICES = np.tile(np.eye(4), (COUNT, 1, 1))
MATRICES[:, :3, :3], MATRICES[:, :3, 3] = TURNS.as_matrix(), PLACES
SIX = [1, 2, 3] * 2
FRANKAS = {  # by kind, frame of the state, and that of its base: messages, matrices by columns
    ("FrankaRobotState", "link0", "link0"): [
        {
            "o_f_ext_hat_k": {**head(0, "link0"), "wrench": {"force": FORCE}},
            "o_t_ee": {**head(0, "link0"), "pose": one},
        }
        for one in ONE
    ],
    ("FrankaState", "", "franka_base"): [
        {"O_T_EE": list(matrix.T.ravel()), "O_F_ext_hat_K": SIX} for matrix in MATRICES
    ],
    ("FrankaState", "link0", "link0"): [
        {"o_t_ee": list(matrix.T.ravel()), "o_f_ext_hat_k": SIX} for matrix in MATRICES
    ],
}


@pytest.mark.parametrize("franka", FRANKAS)
def test_a_franka_is_pose_and_for_lack_of_a_sensor_force(params, franka) -> None:
    kind, frame, base = franka
    state = channel("/state", f"franka_msgs/{kind}", FRANKAS[franka], frame=frame)
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
        (joints("/js", ["finger"], PLACES[:, :1]), {}, "/js has the joints of fingers alone: put"),
        (joints("/js", ["x"], PLACES[:, :1]), {"urdf": "no.urdf"}, "no.urdf: cannot be read"),
    ],
)
def test_a_missing_pose_says_what_would_do(params, gantry, channel, setup, words) -> None:
    with pytest.raises(UserError, match=words) as caught:
        chosen(params, wrench("/ft"), channel, **setup)
    text = str(caught.value)
    assert text.startswith("no end-effector pose") and "\n" not in text


def edge(parent: str, child: str, x: float, k: int) -> dict:
    return {
        "timestamp": {"sec": 5, "nsec": k},
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": {"x": x, "y": 0, "z": 0},
        "rotation": {"x": 0, "y": 0, "z": 0, "w": 1},
    }


def test_foxglove_transforms_that_keep_still_are_static() -> None:
    moving = [edge("base", "hand", 0.1 * k, k) for k in range(5)]
    still = [edge("base", "fork", 0.5, k) for k in range(5)]
    once = {"transforms": [edge("fork", "camera", 0.25, 0)]}
    many = channel("/tf", "foxglove.FrameTransform", [*moving, *still])
    batch = channel("/tf2", "foxglove.FrameTransforms", [once])
    tree = transforms_of(Container(Path("f.mcap"), [many, batch], []))
    np.testing.assert_allclose(tree.between("base", "camera").translation, [0.75, 0, 0])
    assert tree.between("base", "hand") is None
