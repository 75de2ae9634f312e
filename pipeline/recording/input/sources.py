"""How a topic is read for a role where its schema alone does not say: joints and twists."""

from __future__ import annotations

from collections import Counter
from functools import partial

from pipeline.base.errors import UserError
from pipeline.recording.input import readings as of
from pipeline.recording.input.container import Channel
from pipeline.recording.input.decode import Decoder
from pipeline.recording.input.kinematics import chain_of, integrated
from pipeline.recording.input.roles import JOINTS, ROLES, TWIST, Convert, Read, readable

TRIES = 50  # messages that are looked at to know a topic; some share it with other publishers
TOOLS = {"tcp", "ee", "eef", "tool", "tool0", "hand", "flange", "gripper"}
FINGERS = ("finger", "gripper", "knuckle")
SHOWN = 12  # joints named in a message

Source = tuple[Read, Convert | None]


def source_of(
    role: str, channel: Channel, decode: Decoder, setup: object, named: bool
) -> Source | None:
    """How to read a channel for a role, and how to convert what was read.

    None where it is of the right type, but something else, which is no news to anybody.

    Args:
        role: One of ROLES; the channel's schema is among those of its readers.
        channel, decode: The topic.
        setup: params.setup.
        named: Whether params name the topic.

    Raises:
        UserError: where it would be if params said more, or if it could be read.
    """
    kind = of.kind_of(channel.schema.name)
    if role == "gripper":
        return _gripper(channel, decode, named)
    if role == "pose" and kind in JOINTS:
        return _arm(channel, decode, setup)
    if role == "pose" and kind in TWIST:
        return _motion(channel, decode, setup, TWIST[kind])
    return ROLES[role].readers[kind], None


def _gripper(channel: Channel, decode: Decoder, named: bool) -> Source | None:
    """The joints of a gripper, not of an arm; all joints where params name the topic."""
    by_topic = named or _has(FINGERS, channel.topic)
    for names in _joint_names(channel, decode):
        fingers = tuple(name for name in names if _has(FINGERS, name))
        if fingers or by_topic:
            only = tuple(name for name in fingers if "finger" in name.lower())
            return of.opening_reader(only or fingers or names), None
    return None


def _arm(channel: Channel, decode: Decoder, setup: object) -> Source | None:
    """Joint states through params' URDF."""
    known = _joint_names(channel, decode)
    arms = [some for some in known if not all(_has(FINGERS, name) for name in some)]
    if not arms:
        return None
    names = arms[0]
    has = ", ".join(names[:SHOWN])
    if setup.urdf is None:
        raise UserError(
            f"{channel.topic} has the joints {has}: put the robot's URDF into robots/ and name it"
            " in setup.urdf"
        )
    chain = chain_of(setup.urdf, setup.tip_link)
    if not any(set(chain.names) <= set(some) for some in known):
        lacks = ", ".join([name for name in chain.names if name not in names][:SHOWN])
        raise UserError(
            f"{channel.topic} lacks joint {lacks} of {setup.urdf}, it has {has}: check setup.urdf"
            " and setup.tip_link"
        )
    read = of.joints_reader(chain.names, chain.root)
    return read, lambda stamps, values: chain.poses(values)


def _motion(channel: Channel, decode: Decoder, setup: object, read: Read) -> Source:
    """A twist alone, integrated from params' start pose."""
    messages, _ = readable(decode, channel.payloads[:TRIES], TRIES)
    frames = Counter(of.frame_of(message) for message in messages)
    frame = max(frames, key=frames.get, default="")
    if set(frame.lower().split("_")) & TOOLS:
        raise UserError(
            f"the twist on {channel.topic} is along the axes of the hand ({frame}), publish it"
            " along those of the robot's base"
        )
    if setup.start_pose is None:
        raise UserError(
            f"{channel.topic} has a twist: give the hand's pose in the base at its first message"
            " in setup.start_pose"
        )
    return read, partial(integrated, start=setup.start_pose)


def _joint_names(channel: Channel, decode: Decoder) -> list[tuple[str, ...]]:
    """Names in the first messages, the most frequent first. Raises UserError if there are none."""
    messages, _ = readable(
        lambda payload: tuple(of.joints_of(decode(payload))), channel.payloads[:TRIES], TRIES
    )
    names = [some for some, _ in Counter(messages).most_common() if some]
    if not names:
        raise UserError(f"{channel.topic} has fewer than two readable messages (no positions)")
    return names


def _has(words: tuple[str, ...], name: str) -> bool:
    return any(word in name.lower() for word in words)
