"""Reading: what another library wrote comes back; damage is noticed; bad input is one line."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import messages
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.files import read_container
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.streams import read_recording, recording_of
from validation.recordings.bag import START, blind_bag, edit, messages_of


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
