"""Small recordings of every family and in every container, and params as small.

Each holds the same pull. It becomes an episode in about a tenth of a second.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace as Message

import cv2
import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory

from pipeline.params import Params, load
from validation.projects import DEFAULTS
from validation.recordings.bag import (
    Lens,
    RosWriter,
    Truth,
    messages_of,
    write_again,
    write_bag,
)
from validation.recordings.foxglove_bag import translate

CONTAINERS = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "plain": {"compression": CompressionType.NONE},
    "unchunked": {"use_chunking": False, "enable_data_crcs": True},
}
TRUTH = Truth(grasp=0.4, lifted=0.6, drawn=1.1, release=1.6003, end=2.2, radius=0.012)
LENS = Lens(size=(80, 60), focal=62.5, fps=8)
STATE = "franka_msgs/msg/FrankaRobotState"
STATE_FIELDS = """std_msgs/Header header
sensor_msgs/JointState measured_joint_state
geometry_msgs/WrenchStamped o_f_ext_hat_k
geometry_msgs/PoseStamped o_t_ee
uint8 robot_mode
"""
IMAGE = "sensor_msgs/msg/Image"


def write_small(path: Path, family: str, container: str) -> None:
    """Write one recording; see FAMILIES and CONTAINERS."""
    with TemporaryDirectory() as folder:
        bag, other = Path(folder) / "bag.mcap", Path(folder) / "other.mcap"
        write_bag(bag, TRUTH, rate=200, pose_rate=200 if family == "franka" else 50, lens=LENS)
        FAMILIES[family](bag, other)
        write_again(messages_of(other), path, **{"chunk_size": 12_000, **CONTAINERS[container]})


def small_params() -> Params:
    """The project's, for a window, pictures and a band as small as the recordings'."""
    whole = load(DEFAULTS)
    episode = {"duration": 2.0, "samples": 50, "tail": 0.3}
    cloud = {"points": 50, "statistical_neighbors": 5, "radius": 0.05, "radius_neighbors": 2}
    band = whole.bands["band1"].model_copy(update={"diameter": 2 * TRUTH.radius})
    sections = {
        "episode": whole.episode.model_copy(update=episode),
        "cloud": whole.cloud.model_copy(update=cloud),
        "bands": {"band1": band},
    }
    return whole.model_copy(update=sections)


def _franka(source: Path, target: Path) -> None:
    """The arm's state instead of pose and force, and raw depth, as franka_ros2 and a driver do."""
    with source.open("rb") as file, target.open("wb") as out:
        writer, pose = RosWriter(out), None
        writer.register(STATE, STATE_FIELDS)
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, record, message in reader.iter_decoded_messages():
            kind = schema.name.rsplit("/", 1)[-1]
            if kind == "PoseStamped":
                pose = message
            elif kind == "WrenchStamped":
                joints = Message(
                    header=message.header, name=[], position=[], velocity=[], effort=[]
                )
                state = Message(
                    header=message.header,
                    measured_joint_state=joints,
                    o_f_ext_hat_k=message,
                    o_t_ee=pose,
                    robot_mode=2,
                )
                writer.write("/franka/robot_state", STATE, record.log_time, state)
            elif kind == "CompressedImage" and "compressedDepth" in message.format:
                writer.write("/camera/depth/image_raw", IMAGE, record.log_time, _raw(message))
            else:
                writer.write(channel.topic, schema.name, record.log_time, message)
        writer.finish()


def _raw(packed: Message) -> Message:
    """A compressedDepth picture as sensor_msgs/Image."""
    pixels = cv2.imdecode(np.frombuffer(packed.data, np.uint8)[12:], cv2.IMREAD_UNCHANGED)
    height, width = pixels.shape
    return Message(
        header=packed.header,
        height=height,
        width=width,
        encoding="16UC1",
        is_bigendian=0,
        step=2 * width,
        data=pixels.tobytes(),
    )


FAMILIES: dict[str, Callable[[Path, Path], object]] = {
    "ros2": shutil.copyfile,  # CDR, pictures as JPEG and PNG
    "franka": _franka,
    "protobuf": partial(translate, encoding="protobuf", raw=True),
    "json": partial(translate, encoding="json"),
}
