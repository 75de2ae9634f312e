"""A ROS 2 recording written again with Foxglove's schemas, in protobuf or JSON, by Foxglove's SDK.

What was recorded is read with mcap-ros2-support. Foxglove has no wrench schema: here it is one of
the lab's own.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path

import cv2
import foxglove
import numpy as np
from foxglove import messages as fox
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.json_format import ParseDict
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.timestamp_pb2 import DESCRIPTOR as TIMESTAMP
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
    channels = {}
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
                name = "foxglove.RawImage" if raw and kind == "CompressedImage" else SCHEMAS[kind]
                channels[topic] = _channel(topic, name, encoding, context)
            out, pack = channels[topic]
            out.log(pack(fields(kind, message, raw)), log_time=record.log_time)


def fields(kind: str, message: object, raw: bool) -> dict[str, object]:
    """A ROS message as Foxglove's schema has it in JSON, from which protobuf makes its own."""
    if kind == "TFMessage":
        return {"transforms": [_transform(transform) for transform in message.transforms]}
    head = {"timestamp": _time(message), "frame_id": message.header.frame_id}
    if kind == "WrenchStamped":
        return {**head, "wrench": {"force": _axes(message.wrench.force, "xyz")}}
    if kind == "PoseStamped":
        position = _axes(message.pose.position, "xyz")
        orientation = _axes(message.pose.orientation, "xyzw")
        return {**head, "pose": {"position": position, "orientation": orientation}}
    if kind == "JointState":
        joints = zip(message.name, message.position, strict=True)
        joints = [{"name": name, "position": place} for name, place in joints]
        return {"timestamp": head["timestamp"], "joints": joints}
    if kind == "CameraInfo":
        size = {"width": message.width, "height": message.height}
        numbers = {name.upper(): list(getattr(message, name)) for name in "dkrp"}
        return {**head, **size, "distortion_model": message.distortion_model, **numbers}
    depth = "compressedDepth" in message.format
    data = bytes(message.data)[12 if depth else 0 :]
    if not raw:
        return {**head, "format": "png" if depth else "jpeg", "data": _text(data)}
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    pixels = (pixels / 1000).astype(np.float32) if depth else pixels[..., ::-1]
    height, width = pixels.shape[:2]
    encoding, step = ("32FC1", 4 * width) if depth else ("rgb8", 3 * width)
    size = {"height": height, "width": width, "encoding": encoding, "step": step}
    return {**head, **size, "data": _text(pixels.tobytes())}


def _time(message: object) -> str:
    stamp = message.header.stamp
    return f"{np.datetime64(stamp.sec * 10**9 + stamp.nanosec, 'ns')}Z"


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _axes(vector: object, names: str) -> dict[str, float]:
    return {name: getattr(vector, name) for name in names}


def _transform(transform: object) -> dict[str, object]:
    return {
        "timestamp": _time(transform),
        "parent_frame_id": transform.header.frame_id,
        "child_frame_id": transform.child_frame_id,
        "translation": _axes(transform.transform.translation, "xyz"),
        "rotation": _axes(transform.transform.rotation, "xyzw"),
    }


def _channel(
    topic: str, name: str, encoding: str, context: foxglove.Context
) -> tuple[foxglove.Channel, Callable[[dict[str, object]], dict[str, object] | bytes]]:
    """Of the schemas of Foxglove's SDK, and of the lab's own; how its messages are packed."""
    if encoding == "json":
        schema = {"title": name, "type": "object", "properties": {}}
        return foxglove.Channel(topic, schema=schema, context=context), dict
    if name.startswith("lab."):
        times = FileDescriptorProto.FromString(TIMESTAMP.serialized_pb)
        files = FileDescriptorSet(file=[times, _lab_file()]).SerializeToString()
        schema = foxglove.Schema(name=name, encoding=encoding, data=files)
    else:
        schema = getattr(fox, name.removeprefix("foxglove.")).get_schema()
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    message = GetMessageClass(pool.FindMessageTypeByName(name))
    channel = foxglove.Channel(topic, schema=schema, message_encoding=encoding, context=context)
    return channel, lambda content: ParseDict(content, message()).SerializeToString()


LAB = {  # messages of a lab's own, and the fields of each
    "Vector3": {axis: {"type": "TYPE_DOUBLE"} for axis in "xyz"},
    "Wrench": {name: {"type_name": ".lab.Vector3"} for name in ("force", "torque")},
    "WrenchStamped": {
        "timestamp": {"type_name": ".google.protobuf.Timestamp"},
        "frame_id": {"type": "TYPE_STRING"},
        "wrench": {"type_name": ".lab.Wrench"},
    },
}


def _lab_file() -> FileDescriptorProto:
    kinds = [
        {
            "name": name,
            "field": [
                {"name": field, "number": number, "type": "TYPE_MESSAGE", **kind}
                for number, (field, kind) in enumerate(fields.items(), 1)
            ],
        }
        for name, fields in LAB.items()
    ]
    file = {"name": "lab.proto", "package": "lab", "syntax": "proto3", "message_type": kinds}
    return ParseDict({**file, "dependency": [TIMESTAMP.name]}, FileDescriptorProto())
