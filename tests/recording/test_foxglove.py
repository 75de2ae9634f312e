"""The same interaction in other encodings and containers is the same episode."""

from __future__ import annotations

import foxglove
import numpy as np
import pytest

from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording import images
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.streams import Recording, read_recording
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
    assert_same_recording(*(read_recording(file, params.setup) for file in (path, blind[0])))


def assert_same_recording(recording: Recording, usual: Recording) -> None:
    assert recording.losses == usual.losses == []
    assert recording.streams.keys() == usual.streams.keys()
    for role, stream in usual.streams.items():
        np.testing.assert_array_equal(recording.streams[role].stamp, stream.stamp)
        assert recording.streams[role].topic == stream.topic
        if role not in ("color", "depth"):
            np.testing.assert_array_equal(recording.streams[role].values, stream.values)
    assert recording.transforms.frames == usual.transforms.frames
