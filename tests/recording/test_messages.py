"""Every pair of encodings, by another library or the specification."""

from __future__ import annotations

import json
import re
import struct
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import zstandard
from foxglove import messages as fox
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap.records import Schema
from mcap_ros2._dynamic import serialize_dynamic
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_typestore

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import messages
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.files import read_container
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.messages import Reading, Topic, Unreadable
from sling2sim2real.recording.streams import read_recording, recording_of
from validation.recordings.bag import START, blind_bag, edit, messages_of

NAME = "geometry_msgs/msg/WrenchStamped"
MSG = get_typestore(Stores.ROS2_HUMBLE).generate_msgdef(NAME, ros_version=2)[0]
ROS1 = get_typestore(Stores.ROS1_NOETIC).generate_msgdef(NAME)[0]


def channel(name: str, encoding: str, data: bytes, messages: str) -> Topic:
    return Topic.of("/ft", Schema(1, data, encoding, name), messages)


def reading(source: Topic, payload: bytes) -> Reading:
    source.add(1, payload)
    ((read,),) = source.readings.values()
    return read


def cdr() -> bytes:
    vector = SimpleNamespace(x=1.5, y=-2.0, z=3.25)
    header = SimpleNamespace(stamp=SimpleNamespace(sec=12, nanosec=34), frame_id="sensor")
    message = SimpleNamespace(header=header, wrench=SimpleNamespace(force=vector, torque=vector))
    return serialize_dynamic(NAME, MSG)[NAME](message)


@pytest.mark.parametrize(
    ("name", "encoding", "data"),
    [
        (NAME, "ros2msg", MSG.encode()),
        ("geometry_msgs/WrenchStamped", "ros2msg", MSG.encode()),
        # A standard type needs no schema.
        (NAME, "", b""),
        (NAME, "ros2msg", b""),
        (NAME, "ros2msg", NAME.encode()),
        ("geometry_msgs::msg::dds_::WrenchStamped_", "omgidl", b"module geometry_msgs { };"),
        ("geometry_msgs::msg::WrenchStamped", "ros2idl", b"module geometry_msgs { };"),
    ],
)
def test_ros_2(name, encoding, data) -> None:
    sample = reading(channel(name, encoding, data, "cdr"), cdr())
    assert sample == (12_000_000_034, "sensor", (1.5, -2.0, 3.25))


def test_ros_1() -> None:
    """wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes: little endian, packed."""
    frame = b"/sensor"  # ROS 1 has a slash before it
    payload = struct.pack("<IIII", 7, 12, 34, len(frame)) + frame
    payload += struct.pack("<6d", 1.5, -2.0, 3.25, 0, 0, 0)
    source = channel("geometry_msgs/WrenchStamped", "ros1msg", ROS1.encode(), "ros1")
    assert reading(source, payload) == (12_000_000_034, "sensor", (1.5, -2.0, 3.25))


@pytest.mark.parametrize(
    "head",
    [
        {"header": {"stamp": {"sec": 12, "nanosec": 34}, "frame_id": "sensor"}},
        {"header": {"stamp": {"secs": 12, "nsecs": 34}, "frame_id": "/sensor", "seq": 3}},
        {"timestamp": {"sec": 12, "nsec": 34}, "frame_id": "sensor"},
        {"timestamp": {"seconds": "12", "nanos": 34}, "frame_id": "sensor"},
        {"timestamp": "1970-01-01T00:00:12.000000034Z", "frame_id": "sensor"},
    ],
)
def test_json_of_ros_and_of_foxglove(head) -> None:
    force = {"x": 1.5, "y": -2, "z": 3.25}
    payload = json.dumps({**head, "wrench": {"force": force, "torque": force}}).encode()
    source = channel("lab.WrenchStamped", "jsonschema", b"{}", "json")
    assert reading(source, payload) == (12_000_000_034, "sensor", (1.5, -2.0, 3.25))


def test_protobuf_of_foxglove() -> None:
    """Dependencies between the files of the schema, in whatever order they are."""
    schema = fox.PoseInFrame.get_schema()
    files = FileDescriptorSet.FromString(schema.data)
    files.file.extend([files.file.pop(0)])
    source = channel("foxglove.PoseInFrame", "protobuf", files.SerializeToString(), "protobuf")
    pose = fox.Pose(position=fox.Vector3(x=1.5, y=-2.0, z=3.25), orientation=fox.Quaternion(w=1))
    payload = fox.PoseInFrame(timestamp=fox.Timestamp(12, 34), frame_id="base", pose=pose).encode()
    assert reading(source, payload) == (12_000_000_034, "base", (1.5, -2.0, 3.25, 0, 0, 0, 1))


@pytest.mark.parametrize(
    ("name", "encoding", "data", "messages", "words"),
    [
        ("lab/Image", "omgidl", b"", "cdr", "schema 'omgidl' with messages 'cdr' cannot"),
        (NAME, "ros2msg", MSG.encode(), "json", "cannot be read"),
        ("lab.Image", "flatbuffer", b"", "flatbuffer", "ros2msg with cdr.*jsonschema with json"),
        (NAME, "", b"", "json", "no schema with messages 'json'"),
        (NAME, "ros2msg", b"\xff\xfe", "cdr", ""),
        (NAME, "ros2msg", b"gibberish of a schema", "cdr", ""),
        (NAME, "ros2msg", b"std_msgs/Header header", "cdr", ""),
        ("lab_msgs/msg/WrenchStamped", "ros2idl", b"module {", "cdr", "'ros2idl' with messages"),
        ("lab_msgs/msg/WrenchStamped", "", b"", "cdr", "no schema with messages 'cdr'"),
        (NAME, "ros2msg", b"std_msgs/Header header\nfloat32 all\n", "cdr", ""),  # another
        ("lab.Image", "protobuf", b"\xff\xff", "protobuf", ""),
        ("lab.Image", "protobuf", b"", "protobuf", ""),
    ],
)
def test_what_cannot_be_read_is_one_line_with_the_topic(
    name, encoding, data, messages, words
) -> None:
    problem = channel(name, encoding, data, messages).problem
    assert re.search(words, problem) and "topic /ft" in problem and "\n" not in problem


@pytest.mark.parametrize(
    "payload, words",
    [
        (zstandard.compress(cdr())[:-20], ""),
        (b"\0\7\0\0" + cdr()[4:], "in XCDR2"),
        (cdr()[:-1], ""),
        (b"", ""),
    ],
)
def test_messages_that_are_packed_one_by_one_or_damaged(payload, words) -> None:
    source = channel(NAME, "ros2msg", MSG.encode(), "cdr")
    damaged = reading(source, payload)
    assert isinstance(damaged, Unreadable) and words in damaged and "\n" not in damaged
    source = channel(NAME, "ros2msg", MSG.encode(), "cdr")
    assert reading(source, zstandard.compress(cdr())).value == (1.5, -2.0, 3.25)


def read(path: Path, params):
    return read_recording(path, params.setup)


def test_what_another_library_decodes_is_what_we_read(blind, params) -> None:
    path, _ = blind
    recording = read(path, params)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        forces = [
            (m.header.stamp.sec * 10**9 + m.header.stamp.nanosec, m.wrench.force.x)
            for *_, m in reader.iter_decoded_messages(topics=["/ft/wrench"])
        ]
    np.testing.assert_array_equal(recording.wrench.stamp, [stamp for stamp, _ in forces])
    np.testing.assert_array_equal(recording.wrench.values[:, 0], [x for _, x in forces])
    assert recording.wrench.frame == "ft_sensor"
    assert {role: stream.topic for role, stream in recording.streams.items()} == {
        "wrench": "/ft/wrench",
        "pose": "/arm/current_pose",
        "gripper": "/gripper/joint_states",
        "color": "/camera/color/compressed",
        "depth": "/camera/depth/compressedDepth",
    }
    assert recording.losses == []
    assert recording.gripper.values[0, 0] == pytest.approx(0.08)


def test_each_message_is_decoded_once(seen, params, monkeypatch) -> None:
    """From the file to its episode."""
    decoded: Counter[str] = Counter()
    make = messages.decoder

    def counting(schema, encoding):
        decode = make(schema, encoding)

        def counted(payload: bytes):
            decoded[schema.name] += 1
            return decode(payload)

        return counted

    monkeypatch.setattr(messages, "decoder", counting)
    build_episodes(seen[0], "band1", params)
    assert decoded == Counter(schema.name for schema, *_ in messages_of(seen[0]))


def test_a_refusal_says_what_the_file_lost(blind, tmp_path, params) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(blind[0].read_bytes()[:2000])
    with pytest.raises(UserError, match="no force.*cut off or damaged"):
        read(path, params)


def test_poses_and_transforms_without_a_rotation(tmp_path, params) -> None:
    """Some publishers leave the quaternion at zero."""
    nowhere = SimpleNamespace(x=0.0, y=0.0, z=0.0, w=0.0)

    def pose(stamp: int, message) -> None:
        if 0 <= stamp - START < 30_000_000:
            message.pose.orientation = nowhere

    def tree(stamp: int, message) -> None:
        message.transforms[0].transform.rotation = nowhere

    recording = read(blind_bag(tmp_path, change=edit(pose=pose, tf=tree)), params)
    assert recording.pose.lost > 3 and recording.pose.stamp[0] >= START + 30_000_000
    with pytest.raises(UserError, match="setup.base_to_fork"):
        geometry_of(recording, params.setup)


def test_a_missing_topic_is_named(params, blind) -> None:
    container = read_container(blind[0])
    for part, words in (
        ("/ft/", "no force"),
        ("/arm/", "no end-effector pose"),
        ("color/compressed", "no colour images"),
        ("compressedDepth", "no depth images"),
        ("camera_info", "no camera info"),
    ):
        left = [topic for topic in container.topics if part not in topic.name]
        with pytest.raises(UserError, match=words) as caught:
            recording_of(replace(container, topics=left), params.setup)
        assert str(blind[0]) in str(caught.value) and "\n" not in str(caught.value)
