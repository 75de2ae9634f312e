"""Static transforms of a recording, from ROS's /tf_static or Foxglove's FrameTransform."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.base.errors import UserError
from pipeline.recording.input.container import Channel, Container
from pipeline.recording.input.decode import decoder
from pipeline.recording.input.frames import Transform, TransformTree
from pipeline.recording.input.readings import kind_of, quaternion_of

FOXGLOVE = ("FrameTransform", "FrameTransforms")
STILL = 1e-9  # m and quaternion: a transform that changes by more is no static one


def transforms_of(container: Container) -> TransformTree:
    """All of tf_static; of Foxglove's transforms, which share one topic, those that keep still.

    Messages that cannot be read are left out: a transform that is missed is asked for later.
    """
    poses: dict[tuple[str, str], np.ndarray] = {}
    moving: set[tuple[str, str]] = set()
    for channel in container.channels:
        static = channel.topic.rsplit("/", 1)[-1] == "tf_static"
        if not static and kind_of(channel.schema.name) not in FOXGLOVE:
            continue
        for parent, child, pose in _edges(channel):
            edge = (parent, child)
            if not static and np.abs(poses.setdefault(edge, pose) - pose).max() > STILL:
                moving.add(edge)
            poses[edge] = pose
    tree = TransformTree()
    for edge, pose in poses.items():
        if edge not in moving:
            tree.add(*edge, Transform.of(pose))
    return tree


def _edges(channel: Channel) -> Iterator[tuple[str, str, np.ndarray]]:
    """Parent, child, and pose of the child in the parent: x y z qx qy qz qw."""
    try:
        decode = decoder(channel)
    except UserError:
        return
    for payload in channel.payloads:
        try:
            message = decode(payload)
            edges = [_edge(one) for one in getattr(message, "transforms", [message])]
        except Exception:  # whatever damaged bytes do to the decoder
            continue
        yield from (edge for edge in edges if edge is not None)


def _edge(one: object) -> tuple[str, str, np.ndarray] | None:
    if hasattr(one, "transform"):
        parent, child, pose = one.header.frame_id, one.child_frame_id, one.transform
    else:
        parent, child, pose = one.parent_frame_id, one.child_frame_id, one
    place = pose.translation
    try:
        numbers = np.array([place.x, place.y, place.z, *quaternion_of(pose.rotation)], float)
    except ValueError:  # some publishers leave the quaternion at zero
        return None
    return (str(parent), str(child), numbers) if np.isfinite(numbers).all() else None
