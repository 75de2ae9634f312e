"""The hand's motion from a twist alone gives the signals that a pose gives."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mcap.records import Schema

from pipeline.recording.geometry import geometry_of
from pipeline.recording.input.container import read_container
from pipeline.recording.input.contents import Channel
from pipeline.recording.input.reader import Recording, read_recording, recording_of
from pipeline.recording.pulls import Pull
from pipeline.recording.signals import signals_of


@pytest.fixture
def usual(blind, params) -> Recording:
    return read_recording(blind[0], params.setup)


def signals(recording: Recording, params):
    return signals_of(Pull.of(recording, params.setup), params)


def test_a_twist_alone(blind, params, usual) -> None:
    """Trapezoids of the true velocity, 200 a second; at the release it leaps by 0.06 m/s."""
    truth = blind[1]
    t = usual.pose.seconds(int(usual.wrench.stamp[0]))
    base = geometry_of(usual, params.setup).base.rotation.inv()
    step = 1e-5
    velocity = [(truth.hand(x + step) - truth.hand(x - step)) / (2 * step) for x in t]
    container = read_container(blind[0])
    at = next(i for i, channel in enumerate(container.channels) if "Pose" in channel.schema.name)
    payloads = []
    for stamp, row in zip(usual.pose.stamp, base.apply(velocity), strict=True):
        time = {"sec": int(stamp) // 10**9, "nanosec": int(stamp) % 10**9}
        linear, angular = dict(zip("xyz", row, strict=True)), dict.fromkeys("xyz", 0.0)
        twist = {"linear": linear, "angular": angular}
        message = {"header": {"stamp": time, "frame_id": "base"}, "twist": twist}
        payloads.append(json.dumps(message).encode())
    schema = Schema(9, b"", "jsonschema", "geometry_msgs/msg/TwistStamped")
    times = container.channels[at].log_times
    container.channels[at] = Channel("/arm", schema, "json", times, payloads)
    start = {"start_pose": tuple(usual.pose.values[0])}
    recording = recording_of(container, params.setup.model_copy(update=start))
    assert recording.pose.topic == recording.twist.topic == "/arm"
    ours, theirs = signals(recording, params), signals(usual, params)
    before = ours.time < ours.release_time - 0.05
    np.testing.assert_allclose(ours.position[before], theirs.position[before], atol=2e-5)
    leap = 0.06 * 0.5 / 200
    np.testing.assert_allclose(ours.position, theirs.position, atol=2e-5 + leap)
    np.testing.assert_allclose(ours.force, theirs.force, atol=1e-6)
