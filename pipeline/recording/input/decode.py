"""Messages by their schema: a decoder a channel, chosen by (schema encoding, message encoding)."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from types import SimpleNamespace

from mcap_protobuf.decoder import DecoderFactory
from rosbags.typesys import (
    Stores,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)
from rosbags.typesys.store import Typestore

from pipeline.base.errors import UserError
from pipeline.recording.input.container import Channel

Decoder = Callable[[bytes], object]


def decoder(channel: Channel) -> Decoder:
    """A function from payload to a message with attributes.

    Raises:
        UserError: where the encoding is not known or the schema is bad, in one line.
    """
    schema = channel.schema
    make = DECODERS.get((schema.encoding, channel.encoding))
    if make is None:
        known = ", ".join(f"{a} with {b}" for a, b in DECODERS)
        what = f"schema {schema.encoding!r}" if schema.encoding else "no schema"
        raise UserError(
            f"topic {channel.topic}: {what} with messages {channel.encoding!r} cannot be read,"
            f" record one of: {known}"
        )
    try:
        return make(channel)
    except Exception as error:  # the parsers raise many kinds
        reason = str(error).partition("\n")[0]
        raise UserError(f"topic {channel.topic}: bad schema {schema.name} ({reason})") from error


def _ros2(channel: Channel) -> Decoder:
    store, name = _store(channel)
    return lambda payload: store.deserialize_cdr(payload, name)


def _ros1(channel: Channel) -> Decoder:
    store, name = _store(channel)
    return lambda payload: store.deserialize_ros1(payload, name)


def _store(channel: Channel) -> tuple[Typestore, str]:
    """The schema's types, for this channel alone, because recordings may mix versions of a type.

    Also its name as rosbags has it: with the `msg` that ROS 1 leaves out.
    """
    schema = channel.schema
    text = schema.data.decode()
    name = re.sub("^([^/:]+)(/|::)([^/:]+)$", r"\1/msg/\3", schema.name).replace("::", "/")
    store = get_typestore(Stores.EMPTY)
    if schema.encoding == "ros2idl":  # one file a type: mcap.dev/spec/registry#ros2idl
        text = re.sub("^#.*$", "", text, flags=re.MULTILINE)  # rosbags does not know #include
        files = re.split(r"^=+\nIDL: .*\n", text, flags=re.MULTILINE)
        types = [get_types_from_idl(file) for file in files if file.strip()]
        store.register({key: value for some in types for key, value in some.items()})
    else:
        store.register(get_types_from_msg(text, name))
    store.get_msgdef(name)
    return store, name


def _protobuf(channel: Channel) -> Decoder:
    return DecoderFactory().decoder_for(channel.encoding, channel.schema)


def _json(channel: Channel) -> Decoder:
    """By the schema's name alone: fields are found by name, bytes are base64."""
    return lambda payload: json.loads(payload, object_hook=lambda fields: SimpleNamespace(**fields))


DECODERS: dict[tuple[str, str], Callable[[Channel], Decoder]] = {
    ("ros2msg", "cdr"): _ros2,
    ("ros2idl", "cdr"): _ros2,
    ("ros1msg", "ros1"): _ros1,
    ("protobuf", "protobuf"): _protobuf,
    ("jsonschema", "json"): _json,
}
