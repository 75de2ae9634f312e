"""The same interaction in other encodings and containers is the same episode."""

from __future__ import annotations

from pathlib import Path

import foxglove
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from pipeline.episode.episode import Episode
from pipeline.recording.build import build_episodes
from pipeline.recording.input import images
from pipeline.recording.input.reader import Recording, read_recording
from validation.recordings.foxglove_bag import translate


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_foxglove_schemas_give_the_same_episode(encoding, episode, seen, params, tmp_path) -> None:
    path = tmp_path / "foxglove.mcap"
    translate(seen[0], path, encoding)
    assert_same_episode(build_episodes(path, "band1", params)[0][0], episode)


def test_raw_pictures_are_what_the_packed_ones_hold(seen, params, tmp_path) -> None:
    """rgb8, and depth in metres."""
    path = tmp_path / "raw.mcap"
    translate(seen[0], path, "protobuf", raw=True)
    usual, raw = (read_recording(file, params.setup) for file in (seen[0], path))
    assert raw.color.values[0].encoding == "rgb8" and raw.depth.values[0].encoding == "32FC1"
    for role, decode in (("color", images.color), ("depth", images.depth)):
        ours, theirs = raw.streams[role].values, usual.streams[role].values
        assert len(ours) == len(theirs) > 50
        for picture, other in zip(ours[::10], theirs[::10], strict=True):
            np.testing.assert_array_equal(decode(picture), decode(other))


def assert_same_episode(episode: Episode, usual: Episode) -> None:
    for name in ("time", "position", "velocity", "force", "opening", "cloud_time", "camera"):
        np.testing.assert_allclose(getattr(episode, name), getattr(usual, name), atol=1e-12)
    assert episode.release_time == usual.release_time
    assert episode.grasp_time == usual.grasp_time
    assert len(episode.clouds) == len(usual.clouds)
    for ours, theirs in zip(episode.clouds, usual.clouds, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-6)


CONTAINERS = {
    "zstd": {"compression": foxglove.mcap.MCAPCompression.Zstd},
    "lz4": {"compression": foxglove.mcap.MCAPCompression.Lz4},
    "none": {"compression": None},
    "without chunks": {"use_chunks": False},
    "without indexes": {
        "emit_summary_offsets": False,
        "emit_message_indexes": False,
        "emit_chunk_indexes": False,
        "emit_statistics": False,
        "repeat_channels": False,
        "repeat_schemas": False,
    },
}


@pytest.mark.parametrize("container", CONTAINERS)
def test_every_container(container, blind, params, tmp_path) -> None:
    path = tmp_path / "other.mcap"
    translate(blind[0], path, "protobuf", **CONTAINERS[container])
    assert_same_recording(read_recording(path, params.setup), blind[0], params)


def test_a_bag_of_rosbags(blind, params, tmp_path) -> None:
    """What rosbags writes, message by message, from what mcap-ros2-support wrote."""
    from mcap.reader import make_reader

    store = get_typestore(Stores.ROS2_HUMBLE)
    folder = tmp_path / "bag"
    with (
        Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer,
        blind[0].open("rb") as file,
    ):
        connections = {}
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic not in connections:
                connections[channel.topic] = writer.add_connection(
                    channel.topic, schema.name, typestore=store
                )
            writer.write(connections[channel.topic], message.log_time, message.data)
    path = next(folder.glob("*.mcap"))
    assert_same_recording(read_recording(path, params.setup), blind[0], params)


def assert_same_recording(recording: Recording, path: Path, params) -> None:
    usual = read_recording(path, params.setup)
    assert recording.losses == usual.losses == []
    assert set(recording.streams) == set(usual.streams)
    for role, stream in usual.streams.items():
        np.testing.assert_array_equal(recording.streams[role].stamp, stream.stamp)
        assert recording.streams[role].topic == stream.topic
        if isinstance(stream.values, np.ndarray):
            np.testing.assert_array_equal(recording.streams[role].values, stream.values)
