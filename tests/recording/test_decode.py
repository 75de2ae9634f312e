"""Every pair of encodings, from bytes of another library or by the format's specification."""

from __future__ import annotations

import json
import re
import struct
from types import SimpleNamespace

import pytest
import zstandard
from foxglove import messages as fox
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.records import Schema
from mcap_ros2._dynamic import serialize_dynamic
from rosbags.typesys import Stores, get_typestore

from sling2sim2real.recording.messages import Reading, Topic, Unreadable

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
