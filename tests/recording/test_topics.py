"""Choosing among topics, and saying what lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mcap.records import Schema

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.messages import Topic
from sling2sim2real.recording.topics import camera_of
from tests.recording.messages import (
    CAMERA,
    PLACES,
    TIMES,
    chosen,
    info,
    joints,
    picture,
    played,
    pose,
    wrench,
)


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
    frames = {"color": "color", "aligned_depth_to_color": "color", "depth": "d", "infra1": "d"}
    encodings = {"color": "rgb8", "infra1": "mono8"}
    camera = [
        channel
        for name, frame in frames.items()
        for channel in (
            picture(f"/cam/{name}/image_raw", encodings.get(name, "16UC1"), frame),
            info(f"/cam/{name}/camera_info", frame),
        )
    ]
    roles = chosen(params, wrench("/ft300/wrench"), pose(), camera=camera)
    assert {role: choice.topic.name for role, choice in roles.items()} == {
        "wrench": "/ft300/wrench",
        "pose": "/arm/current_pose",
        "color": "/cam/color/image_raw",
        "depth": "/cam/aligned_depth_to_color/image_raw",
        "color_info": "/cam/color/camera_info",
        "depth_info": "/cam/aligned_depth_to_color/camera_info",
    }


# Camera infos


def cameras(params, *channels: Topic, **topics: str):
    roles = chosen(params, wrench("/ft"), pose(), camera=channels, topics=topics)
    focals = [camera_of(roles, role).matrix[0, 0] for role in ("color", "depth")]
    return roles, focals


def test_each_camera_has_its_own_info(params) -> None:
    color, color_info, depth, depth_info = CAMERA
    assert cameras(params, *CAMERA)[1] == [50, 40]
    assert cameras(params, *reversed(CAMERA))[1] == [50, 40]
    away = info("/calibration/depth", "depth", 30.0)  # elsewhere, but of that frame and size
    roles, focals = cameras(params, color, color_info, depth, away)
    assert focals == [50, 30]
    assert roles["depth_info"].why == "of the frame and size of /cam/depth/image"
    assert roles["color_info"].why == "beside /cam/color/image"
    flat = [picture("/cam/color", "rgb8", "color"), picture("/cam/depth", "16UC1", "depth")]
    flat += [info("/cam/color_info", "color"), info("/cam/depth_info", "depth", 40.0)]
    assert cameras(params, *flat)[1] == [50, 40]


def test_a_damaged_first_message_does_not_decide(params) -> None:
    color, color_info, depth, depth_info = CAMERA
    first, *others = depth.readings["picture"]
    first = first._replace(value=replace(first.value, encoding="16QC1"))
    bad_depth = replace(depth, readings={"picture": [first, *others]})
    assert cameras(params, color, color_info, bad_depth, depth_info)[1] == [50, 40]


def test_registered_depth_may_use_the_colour_cameras(params) -> None:
    color, color_info, *_ = CAMERA
    depth = picture("/cam/aligned/image", "16UC1", "color")
    roles, focals = cameras(params, color, color_info, depth)
    assert focals == [50, 50]
    assert roles["depth_info"].why == "of the frame and size of /cam/aligned/image"


@pytest.mark.parametrize(
    ("depth", "words"),
    [
        (picture("/cam/depth/image", "16UC1", "depth"), "info"),
        (picture("/cam/depth/image", "16UC1", "color", 8, 4), "8 x 4"),
    ],
)
def test_unregistered_depth_must_not_use_the_colour_cameras(params, depth, words) -> None:
    color, color_info, *_ = CAMERA
    with pytest.raises(UserError, match=f"no camera info of the depth.*{words}"):
        cameras(params, color, color_info, depth)
    one_folder = [picture("/cam/color", "rgb8", "color"), picture("/cam/depth", "16UC1", "depth")]
    with pytest.raises(UserError, match="no camera info of the depth"):
        cameras(params, *one_folder, info("/cam/camera_info", "color"))
    for nameless in (
        [color, info("/cam/color/camera_info", ""), depth],
        [color, color_info, picture("/cam/depth/image", "16UC1", "")],
    ):
        with pytest.raises(UserError, match="no camera info of the depth"):
            cameras(params, *nameless)
    roles, _ = cameras(params, *CAMERA[:3], depth_info="/cam/color/camera_info")
    assert roles["depth_info"].why == "setup.topics.depth_info"  # who says so is believed


# What lacks


def test_pictures_that_cannot_be_decoded_are_refused_beforehand(params) -> None:
    bayer = picture("/cam/color/bayer", "bayer_rggb8", "color")
    with pytest.raises(UserError, match="no colour images.*/cam/color/bayer.*'bayer_rggb8'"):
        chosen(params, wrench("/ft"), pose(), camera=[bayer, *CAMERA[1:]])
    assert chosen(params, wrench("/ft"), pose(), camera=[bayer, *CAMERA])
    with pytest.raises(
        UserError, match="setup.topics.color is .*/cam/color/bayer: .*'bayer_rggb8'"
    ):
        topics = {"color": "/cam/color/bayer"}
        chosen(params, wrench("/ft"), pose(), camera=[bayer, *CAMERA], topics=topics)


@pytest.mark.parametrize(
    ("topics", "words"),
    [
        ({"wrench": "/none"}, "setup.topics.wrench is /none; the file has /arm/current"),
        (
            {"pose": "/ft"},
            "setup.topics.pose is /ft; .*/ft .Wrench.* none of a type that is read for it .PoseSt",
        ),
        (
            {"pose": "/js"},
            "setup.topics.pose is /js; /js has the joints j1, j2, j3: put the robot's URDF",
        ),
        ({"depth": "/cam/color/image"}, "setup.topics.depth is .*/cam/color/image: .*'rgb8'"),
        ({"color_info": "/ft"}, "read for it .CameraInfo, CameraCalibration"),
    ],
)
def test_named_topics_that_will_not_do(params, topics, words) -> None:
    arm = joints("/js", ["j1", "j2", "j3"], PLACES)
    with pytest.raises(UserError, match=words) as caught:
        chosen(params, wrench("/ft"), pose(), arm, topics=topics)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("schema", "encoding", "words"),
    [
        (Schema(0, b"", "", ""), "json", "the file has .*/ft .json topic without a schema"),
        (Schema(1, b"", "flatbuffer", "lab.WrenchStamped"), "flatbuffer", "no force.*flatbuffer"),
    ],
)
def test_a_topic_that_cannot_be_read_is_named_if_nothing_else_will_do(
    params, schema, encoding, words
) -> None:
    other = Topic.of("/ft", schema, encoding)
    other.add(1, b"{}")
    with pytest.raises(UserError, match=words):
        chosen(params, other, pose())
    with pytest.raises(
        UserError, match="setup.topics.wrench is /ft; (the file has|topic /ft: schema)"
    ):
        chosen(params, other, pose(), topics={"wrench": "/ft"})
    assert chosen(params, other, wrench("/ft2"), pose())["wrench"].topic.name == "/ft2"
