"""Messages by their schema: a decoder a channel, chosen by (schema encoding, message encoding)."""

from __future__ import annotations

from collections.abc import Callable

from rosbags.typesys import (
    Stores,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)

from pipeline.errors import UserError
from pipeline.recording.container import Channel


def decoder(channel: Channel) -> Callable[[bytes], object]:
    """A function from payload to message. Raises UserError where the encoding is not known."""
    schema, encodings = channel.schema, (channel.schema.encoding, channel.encoding)
    if encodings not in (("ros2msg", "cdr"), ("ros2idl", "cdr")):
        raise UserError(
            f"topic {channel.topic}: schema {encodings[0]!r} with messages {encodings[1]!r} cannot"
            " be read, record ROS 2 messages (ros2msg or ros2idl, cdr)"
        )
    try:
        text = schema.data.decode()
        idl = schema.encoding == "ros2idl"
        types = get_types_from_idl(text) if idl else get_types_from_msg(text, schema.name)
        # A store of its own for each channel: recordings may mix versions of a type.
        store = get_typestore(Stores.EMPTY)
        store.register(types)
        store.get_msgdef(schema.name)
    except Exception as error:  # the parsers raise many kinds
        raise UserError(f"topic {channel.topic}: bad schema {schema.name} ({error})") from error
    return lambda payload: store.deserialize_cdr(payload, schema.name)
