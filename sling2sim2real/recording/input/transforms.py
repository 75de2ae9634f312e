"""Static transforms of a recording, from ROS's /tf_static or Foxglove's FrameTransform."""

from __future__ import annotations

from itertools import chain

import numpy as np

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.input.container import Container
from sling2sim2real.recording.input.decode import Message, decoder, message_reader
from sling2sim2real.recording.input.frames import Transform, TransformTree
from sling2sim2real.recording.input.readings import kind_of, quaternion_of
from sling2sim2real.recording.input.roles import readable

Edge = tuple[str, str]
FOXGLOVE = ("FrameTransform", "FrameTransforms")
STILL = 1e-9  # m and quaternion: a transform that changes by more is no static one


def transforms_of(container: Container) -> TransformTree:
    """All of tf_static; of Foxglove's transforms, which share one topic, those that keep still.

    Messages that cannot be read are left out: a transform that is missed is asked for later.

    """
    poses: dict[Edge, np.ndarray] = {}
    moving: set[Edge] = set()
    for channel in container.channels:
        static = channel.topic.rsplit("/", 1)[-1] == "tf_static"
        if not static and kind_of(channel.schema.name) not in FOXGLOVE:
            continue
        try:
            decode = decoder(channel)
        except UserError:
            continue
        messages, _ = readable(message_reader(decode, _edges), channel.payloads, None)
        for edge, pose in chain.from_iterable(messages):
            if not static and np.abs(poses.setdefault(edge, pose) - pose).max() > STILL:
                moving.add(edge)
            poses[edge] = pose
    still = {edge: pose for edge, pose in poses.items() if edge not in moving}
    tree = TransformTree()
    for edge, pose in still.items():
        tree.add(*edge, Transform.of(pose))
    return tree


def _edges(message: Message) -> list[tuple[Edge, np.ndarray]]:
    """Parent and child, and pose of the child in the parent: x y z qx qy qz qw."""
    edges = []
    for stamped in getattr(message, "transforms", [message]):
        if hasattr(stamped, "transform"):
            edge, pose = (stamped.header.frame_id, stamped.child_frame_id), stamped.transform
        else:
            edge, pose = (stamped.parent_frame_id, stamped.child_frame_id), stamped
        place = pose.translation
        try:
            numbers = np.array([place.x, place.y, place.z, *quaternion_of(pose.rotation)], float)
        except ValueError:  # some publishers leave the quaternion at zero
            continue
        if np.isfinite(numbers).all():
            edges.append((tuple(printable(str(name)) for name in edge), numbers))
    return edges
