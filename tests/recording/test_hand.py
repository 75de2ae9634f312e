"""The hand's motion from joint states or from a twist alone gives the signals that a pose gives."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mcap.records import Schema

from pipeline.recording.geometry import geometry_of
from pipeline.recording.input import kinematics
from pipeline.recording.input.container import Channel, read_container
from pipeline.recording.input.reader import Recording, read_recording, recording_of
from pipeline.recording.signals import signals_of

URDF = """<robot name="gantry">
<joint name="x" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/></joint>
<joint name="y" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>
<joint name="z" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint>
<joint name="wrist" type="fixed"><parent link="c"/><child link="hand_tcp"/>
  <origin rpy="{rpy}"/></joint></robot>"""


@pytest.fixture
def usual(blind, params) -> Recording:
    return read_recording(blind[0], params.setup)


def instead_of_the_pose(blind, params, usual, kind: str, rows, fields, **setup) -> Recording:
    """The recording with other messages at the pose's stamps, and the hand as it is read then."""
    container = read_container(blind[0])
    at = next(i for i, one in enumerate(container.channels) if "Pose" in one.schema.name)
    old = container.channels[at]
    payloads = [
        json.dumps(
            {
                "header": {
                    "stamp": {"sec": int(stamp) // 10**9, "nanosec": int(stamp) % 10**9},
                    "frame_id": "base",
                },
                **fields(row),
            }
        ).encode()
        for stamp, row in zip(usual.pose.stamp, rows, strict=True)
    ]
    new = Channel("/arm", Schema(9, b"", "jsonschema", kind), "json", old.log_times, payloads)
    container.channels[at] = new
    return recording_of(container, params.setup.model_copy(update=setup))


def signals(recording: Recording, params):
    geometry = geometry_of(recording, params.setup)
    return signals_of(recording, geometry, params)


def test_joint_states_through_a_urdf(blind, params, usual, tmp_path, monkeypatch) -> None:
    from scipy.spatial.transform import Rotation

    rpy = Rotation.from_quat(usual.pose.values[0, 3:]).as_euler("xyz")
    (tmp_path / "gantry.urdf").write_text(URDF.format(rpy=" ".join(map(repr, map(float, rpy)))))
    monkeypatch.setattr(kinematics, "FOLDER", tmp_path)
    found = instead_of_the_pose(
        blind,
        params,
        usual,
        "sensor_msgs/msg/JointState",
        usual.pose.values[:, :3],
        lambda row: {"name": ["z", "y", "x"], "position": list(row[::-1])},
        urdf="gantry.urdf",
    )
    assert found.pose.topic == "/arm" and found.pose.frame == "base"
    ours, theirs = signals(found, params), signals(usual, params)
    np.testing.assert_allclose(ours.position, theirs.position, atol=1e-9)
    np.testing.assert_allclose(ours.force, theirs.force, atol=1e-6)


def test_a_twist_alone(blind, params, usual) -> None:
    """Trapezoids of the true velocity, 200 a second; at the release it leaps by 0.06 m/s."""
    truth = blind[1]
    t = usual.pose.seconds(int(usual.wrench.stamp[0]))
    base = geometry_of(usual, params.setup).base.rotation.inv()
    step = 1e-5
    velocity = [(truth.hand(x + step) - truth.hand(x - step)) / (2 * step) for x in t]
    found = instead_of_the_pose(
        blind,
        params,
        usual,
        "geometry_msgs/msg/TwistStamped",
        base.apply(velocity),
        lambda row: {
            "twist": {
                "linear": dict(zip("xyz", row, strict=True)),
                "angular": dict.fromkeys("xyz", 0.0),
            }
        },
        start_pose=tuple(usual.pose.values[0]),
    )
    assert found.pose.topic == found.twist.topic == "/arm"
    ours, theirs = signals(found, params), signals(usual, params)
    before = ours.time < ours.release_time - 0.05
    np.testing.assert_allclose(ours.position[before], theirs.position[before], atol=2e-5)
    leap = 0.06 * 0.5 / 200
    np.testing.assert_allclose(ours.position, theirs.position, atol=2e-5 + leap)
    np.testing.assert_allclose(ours.force, theirs.force, atol=1e-6)
