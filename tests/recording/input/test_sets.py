"""Topics of two arms, dead ones and merged ones: the set that pulled the band is taken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.base.errors import UserError
from pipeline.recording.input import sets
from pipeline.recording.input.contents import Channel
from tests.recording.input.messages import CAMERA, channel, chosen, info, picture, pose_fields

RATE, COUNT = 100.0, 800
TIME = np.arange(COUNT) / RATE
RELEASE = 6.0
DRAW = 0.3 * np.clip((TIME - 2) / 3, 0, 1)  # m
HELD = 40.0 * DRAW * (TIME < RELEASE)  # N
CLOSED = np.where((TIME > 1) & (TIME < RELEASE), 1.0, 0.0)
RANDOM = np.random.default_rng(3)


def head(k: int, frame: str) -> dict:
    stamp = {"sec": 5 + k // 100, "nanosec": 10_000_000 * (k % 100)}
    return {"header": {"stamp": stamp, "frame_id": frame}}


def force(topic: str, pull: np.ndarray, frame: str = "sensor", noise: float = 0.03) -> Channel:
    values = np.stack([0 * TIME, pull, 0 * TIME], axis=1) + RANDOM.normal(0, noise, (COUNT, 3))
    messages = [
        {**head(k, frame), "wrench": {"force": dict(zip("xyz", row, strict=True))}}
        for k, row in enumerate(values.tolist())
    ]
    return channel(topic, "geometry_msgs/WrenchStamped", messages)


def hand(topic: str, way: np.ndarray, frame: str = "base") -> Channel:
    places = np.stack([0.4 + 0 * TIME, -way, 0.3 + 0 * TIME], axis=1)
    turn = [0.0, 0.0, 0.0, 1.0]
    messages = [
        {**head(k, frame), "pose": pose_fields(np.array([*place, *turn]))}
        for k, place in enumerate(places)
    ]
    return channel(topic, "geometry_msgs/msg/PoseStamped", messages)


def fingers(topic: str, **positions: np.ndarray) -> Channel:
    messages = [
        {
            **head(k, ""),
            "name": list(positions),
            "position": [float(p[k]) for p in positions.values()],
        }
        for k in range(COUNT)
    ]
    return channel(topic, "sensor_msgs/msg/JointState", messages)


def lively(pictures: Channel) -> Channel:
    """The same with another value in each."""
    data = [payload.replace(b"[0", b"[%d" % k) for k, payload in enumerate(pictures.payloads)]
    return replace(pictures, payloads=data)


def topics(roles: dict) -> tuple[str, ...]:
    return tuple(
        roles[name].channel.topic for name in ("wrench", "pose", "gripper") if name in roles
    )


def wandering(seed: int) -> np.ndarray:
    """The way of an arm that does something else [m]."""
    steps = np.random.default_rng(seed).normal(size=9)
    return 0.2 * np.interp(TIME, np.linspace(0, 8, 9), np.cumsum(steps) / 3)


@pytest.mark.parametrize(
    "right, left", [("right", "left"), ("left", "right"), ("b", "a"), ("2", "1")]
)
@pytest.mark.parametrize("rests", [True, False])
def test_the_arm_that_pulls(params, right, left, rests) -> None:
    """The other one rests, or moves and carries something; its topics have more messages."""
    way = 0 * TIME if rests else wandering(5)
    load = 0 * TIME if rests else 4 * wandering(6)
    roles = chosen(
        params,
        force(f"/arm_{left}/ft/wrench", load),
        force(f"/arm_{right}/ft/wrench", HELD),
        hand(f"/arm_{left}/pose", way),
        hand(f"/arm_{right}/pose", DRAW),
        fingers(f"/arm_{left}/gripper", finger=0 * TIME),
        fingers(f"/arm_{right}/gripper", finger=0.04 - 0.03 * CLOSED),
    )
    assert topics(roles) == tuple(f"/arm_{right}/{n}" for n in ("ft/wrench", "pose", "gripper"))
    assert not any(choice.doubt for choice in roles.values())


def test_names_tell_by_frames_alone_and_motion_where_names_do_not(params) -> None:
    roles = chosen(
        params,
        force("/ft_a", HELD, "right_sensor"),
        hand("/p/state", wandering(1), "left_base"),
        hand("/q/state", DRAW, "right_base"),
    )
    assert topics(roles) == ("/ft_a", "/q/state")
    roles = chosen(
        params, force("/ft", HELD), hand("/kuka/state", wandering(1)), hand("/ur/pose", DRAW)
    )
    assert topics(roles) == ("/ft", "/ur/pose")


def test_the_force_of_one_arm_is_not_used_with_the_pose_of_another(params) -> None:
    channels = force("/right_arm/wrench", HELD), hand("/left_arm/pose", DRAW)
    with pytest.raises(UserError, match="/left_arm/pose is of another device than the wrench's"):
        chosen(params, *channels)
    named = {"pose": "/left_arm/pose"}
    assert topics(chosen(params, *channels, topics=named)) == (
        "/right_arm/wrench",
        "/left_arm/pose",
    )
    roles = chosen(
        params,
        force("/right_arm/wrench", HELD),
        hand("/right_arm/pose", DRAW),
        fingers("/left_arm/gripper", finger=0.04 - 0.03 * CLOSED),
    )
    assert "gripper" not in roles


def test_two_sets_that_tie_are_said(params) -> None:
    roles = chosen(
        params,
        *(force(f"/arm_{n}/wrench", HELD) for n in (1, 2)),
        *(hand(f"/arm_{n}/pose", DRAW) for n in (1, 2)),
    )
    assert topics(roles) == ("/arm_1/wrench", "/arm_1/pose")
    assert roles["pose"].doubt == "/arm_2/wrench with /arm_2/pose shows a release too"


def test_a_dead_topic_does_not_beat_a_live_one(params) -> None:
    roles = chosen(
        params,
        force("/ft_sensor/wrench_force", 0 * TIME, noise=0.0),
        force("/bus/wrench", HELD),
        hand("/ee/tcp/current_pose", 0 * TIME),
        hand("/state", DRAW),
        fingers("/gripper/gripper_states", finger=0 * TIME),
        fingers("/joints", finger_joint=0.8 * CLOSED),
    )
    assert topics(roles) == ("/bus/wrench", "/state", "/joints")
    noisy = force("/ft_sensor/wrench_force", 0 * TIME)
    roles = chosen(params, noisy, force("/external/wrench", HELD), hand("/state", DRAW))
    assert topics(roles)[0] == "/external/wrench"


def test_the_camera_with_depth(params) -> None:
    webcam = (
        picture("/webcam/rgb/color", "rgb8", "webcam"),
        info("/webcam/rgb/camera_info", "webcam"),
    )
    pull = force("/ft", HELD), hand("/pose", DRAW)
    assert chosen(params, *pull, *webcam)["color"].channel.topic == "/cam/color/image"
    pairs = [
        channel_i
        for n in (1, 2)
        for kind, encoding in (("color", "rgb8"), ("depth", "16UC1"))
        for channel_i in (
            lively(picture(f"/cam{n}/{kind}/image", encoding, f"{kind}{n}")),
            info(f"/cam{n}/{kind}/camera_info", f"{kind}{n}"),
        )
    ]
    roles = chosen(params, *pull, camera=pairs)
    assert [roles[role].channel.topic for role in ("color", "depth")] == [
        "/cam1/color/image",
        "/cam1/depth/image",
    ]
    assert roles["color"].doubt == "/cam2/color/image with /cam2/depth/image is a camera too"


def opening(params, **positions: np.ndarray) -> np.ndarray:
    """What becomes of the fingers in one topic, less its first value."""
    roles = chosen(params, force("/ft", HELD), hand("/p", DRAW), fingers("/joints", **positions))
    choice = roles["gripper"]
    values = [choice.read(payload) for payload in choice.channel.payloads]
    stamps = np.array([sample.stamp for sample in values])
    assert choice.convert is not None
    value = choice.convert(stamps, np.array([sample.value for sample in values], float))
    assert value.shape == (COUNT, 1)
    return value[:, 0] - value[0, 0]


def test_fingers_of_any_sign_and_of_two_devices(params) -> None:
    finger = 0.04 - 0.03 * CLOSED
    other = 0.04 - 0.035 * ((TIME > 2.5) & (TIME < 4))  # closes and opens, but not at the release
    for positions in (
        {"left_finger": finger, "right_finger": finger},
        {"left_finger": finger, "right_finger": -finger},
        {"left_panda_finger1": other, "right_panda_finger1": finger, "right_panda_finger2": finger},
        {"a_finger": finger, "a_other_finger": finger, "b_finger": 0 * TIME},
    ):
        np.testing.assert_allclose(opening(params, **positions), -0.06 * CLOSED, atol=1e-12)
    arm = {f"joint{k}": wandering(k) for k in range(6)}
    result = opening(params, **arm, finger_joint=0.8 * CLOSED)
    np.testing.assert_allclose(result, 0.8 * CLOSED)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 0.3), st.floats(0.3, 7.0))
def test_a_fall_is_found_where_it_is_and_noise_has_none(seed, noise, release) -> None:
    random = np.random.default_rng(seed)
    values = random.normal(0, noise, (COUNT, 3)) + random.normal(0, 9, 3)
    stamps = (1e9 * TIME).astype(np.int64)
    assert sets.fall_of(sets.Track(TIME, stamps, values)) is None
    values[:, 1] += 6 * ((TIME > release / 2) & (TIME < release))
    fall = sets.fall_of(sets.Track(TIME, stamps, values))
    assert fall is not None and abs(TIME[fall] - release) < 0.06


def test_the_cameras_of_the_others_stay(params) -> None:
    assert chosen(params, force("/ft", HELD), hand("/p", DRAW))["color"].channel is CAMERA[0]
