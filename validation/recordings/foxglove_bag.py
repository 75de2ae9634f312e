"""A ROS 2 recording written again with Foxglove's schemas, in protobuf or JSON, by Foxglove's SDK.

What was recorded is read with mcap-ros2-support. Foxglove has no wrench schema: here it is one of
the lab's own.
"""

from __future__ import annotations

import base64
from pathlib import Path

import cv2
import foxglove
import numpy as np
from foxglove import messages as fox
from google.protobuf.descriptor_pb2 import FieldDescriptorProto as Field
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

SCHEMAS = {  # ROS type to Foxglove's, of which the lab's own has no prefix
    "WrenchStamped": "lab.WrenchStamped",
    "PoseStamped": "foxglove.PoseInFrame",
    "JointState": "foxglove.JointStates",
    "CompressedImage": "foxglove.CompressedImage",
    "CameraInfo": "foxglove.CameraCalibration",
    "TFMessage": "foxglove.FrameTransforms",
}


def translate(
    source: Path, target: Path, encoding: str, *, raw: bool = False, **options: object
) -> None:
    """Write `source` again.

    Args:
        source: ROS 2 messages in CDR.
        target: The file to write.
        encoding: "protobuf" or "json".
        raw: Write pictures as RawImage: rgb8, and depth in metres as 32FC1.
        options: Of foxglove.mcap.MCAPWriteOptions.
    """
    context = foxglove.Context()
    writer_options = foxglove.mcap.MCAPWriteOptions(**options)
    make = _Protobuf if encoding == "protobuf" else _Json
    channels: dict[str, object] = {}
    with (
        source.open("rb") as file,
        foxglove.open_mcap(
            target, context=context, writer_options=writer_options, allow_overwrite=True
        ),
    ):
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, record, message in reader.iter_decoded_messages():
            kind = schema.name.rsplit("/", 1)[-1]
            topic = channel.topic.replace("tf_static", "tf")
            if topic not in channels:
                channels[topic] = make(topic, kind, raw, context)
            channels[topic].log(fields(kind, message, raw), record.log_time)


def fields(kind: str, message: object, raw: bool) -> dict[str, object]:
    """A ROS message as the fields of Foxglove's schema, in plain Python."""
    if kind == "TFMessage":
        return {"transforms": [_transform(transform) for transform in message.transforms]}
    stamp = {"sec": message.header.stamp.sec, "nsec": message.header.stamp.nanosec}
    head = {"timestamp": stamp, "frame_id": message.header.frame_id}
    if kind == "WrenchStamped":
        return {**head, "wrench": {"force": _axes(message.wrench.force, "xyz")}}
    if kind == "PoseStamped":
        position = _axes(message.pose.position, "xyz")
        orientation = _axes(message.pose.orientation, "xyzw")
        return {**head, "pose": {"position": position, "orientation": orientation}}
    if kind == "JointState":
        joints = zip(message.name, message.position, strict=True)
        return {"timestamp": stamp, "joints": [{"name": n, "position": p} for n, p in joints]}
    if kind == "CameraInfo":
        size = {"width": message.width, "height": message.height}
        numbers = {name.upper(): list(getattr(message, name)) for name in "dkrp"}
        return {**head, **size, "distortion_model": message.distortion_model, **numbers}
    depth = "compressedDepth" in message.format
    data = bytes(message.data)[12 if depth else 0 :]
    if not raw:
        return {**head, "format": "png" if depth else "jpeg", "data": data}
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    pixels = (pixels / 1000).astype(np.float32) if depth else pixels[..., ::-1]
    height, width = pixels.shape[:2]
    return {
        **head,
        "height": height,
        "width": width,
        "encoding": "32FC1" if depth else "rgb8",
        "step": width * (4 if depth else 3),
        "data": pixels.tobytes(),
    }


def _axes(vector: object, names: str) -> dict[str, float]:
    return {name: getattr(vector, name) for name in names}


def _transform(transform: object) -> dict[str, object]:
    return {
        "timestamp": {"sec": transform.header.stamp.sec, "nsec": transform.header.stamp.nanosec},
        "parent_frame_id": transform.header.frame_id,
        "child_frame_id": transform.child_frame_id,
        "translation": _axes(transform.transform.translation, "xyz"),
        "rotation": _axes(transform.transform.rotation, "xyzw"),
    }


def _schema(kind: str, raw: bool) -> str:
    return "foxglove.RawImage" if raw and kind == "CompressedImage" else SCHEMAS[kind]


class _Json:
    def __init__(self, topic: str, kind: str, raw: bool, context: foxglove.Context) -> None:
        schema = {"title": _schema(kind, raw), "type": "object", "properties": {}}
        self.channel = foxglove.Channel(topic, schema=schema, context=context)

    def log(self, content: dict[str, object], time: int) -> None:
        if "data" in content:
            content = {**content, "data": base64.b64encode(content["data"]).decode()}
        self.channel.log(content, log_time=time)


class _Protobuf:
    """Schemas of Foxglove's SDK, and the lab's own, written by protobuf's runtime."""

    def __init__(self, topic: str, kind: str, raw: bool, context: foxglove.Context) -> None:
        name = _schema(kind, raw)
        if kind == "WrenchStamped":
            files = FileDescriptorSet(file=[_wrench_file()]).SerializeToString()
            schema = foxglove.Schema(name=name, encoding="protobuf", data=files)
        else:
            schema = getattr(fox, name.removeprefix("foxglove.")).get_schema()
        pool = DescriptorPool()
        for file in FileDescriptorSet.FromString(schema.data).file:
            pool.Add(file)
        self.message = GetMessageClass(pool.FindMessageTypeByName(name))
        self.channel = foxglove.Channel(
            topic, schema=schema, message_encoding="protobuf", context=context
        )

    def log(self, content: dict[str, object], time: int) -> None:
        self.channel.log(self.message(**_timed(content)).SerializeToString(), log_time=time)


def _timed(content: dict[str, object]) -> dict[str, object]:
    """Stamps as protobuf's have their fields, also of what lies in a list."""
    timed = {
        name: [_timed(part) for part in value] if name in ("transforms", "joints") else value
        for name, value in content.items()
    }
    if "timestamp" in content:
        stamp = content["timestamp"]
        timed["timestamp"] = {"seconds": stamp["sec"], "nanos": stamp["nsec"]}
    return timed


def _wrench_file() -> FileDescriptorProto:
    file = FileDescriptorProto(name="lab.proto", package="lab", syntax="proto3")

    def message(name: str, **kinds: object) -> None:
        descriptor = file.message_type.add(name=name)
        for number, (field, kind) in enumerate(kinds.items(), 1):
            nested = isinstance(kind, str)
            descriptor.field.add(
                name=field,
                number=number,
                label=Field.LABEL_OPTIONAL,
                type=Field.TYPE_MESSAGE if nested else kind,
                type_name=f".lab.{kind}" if nested else None,
            )

    message("Time", seconds=Field.TYPE_INT64, nanos=Field.TYPE_INT32)
    message("Vector3", **dict.fromkeys("xyz", Field.TYPE_DOUBLE))
    message("Wrench", force="Vector3", torque="Vector3")
    message("WrenchStamped", timestamp="Time", frame_id=Field.TYPE_STRING, wrench="Wrench")
    return file
