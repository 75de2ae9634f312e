"""Messages by their schema: a decoder a channel, chosen by (schema encoding, message encoding)."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import lru_cache
from types import SimpleNamespace
from typing import Any, TypeVar

from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.input import standard
from sling2sim2real.recording.input.contents import Channel

Message = Any  # it has the attributes that its schema says, and whoever reads it finds out
Decoder = Callable[[bytes], Message]
Value = TypeVar("Value")
LONGEST = 2**25  # bytes of one message: a raw 4K picture has less, JSON takes fifty times as much
# What readers raise where fields are missing, of other types or beyond all bounds.
UNFIT = (AttributeError, LookupError, TypeError, ValueError, OverflowError)


class Unreadable(Exception):
    """A message that cannot be read; it says why, in one line."""

    @classmethod
    def by(cls, error: Exception) -> Unreadable:
        return cls(str(error).partition("\n")[0] or type(error).__name__)


class Elsewhere(Unreadable):
    """A message of another publisher on the same topic."""


def decoder(channel: Channel) -> Decoder:
    """A function from payload to a message with attributes; it raises Unreadable.

    Raises:
        UserError: where the encoding is not known or the schema is bad, in one line.
    """
    schema = channel.schema
    by_name = channel.encoding == "cdr" and _says_nothing(schema)
    if not by_name and (schema.encoding, channel.encoding) not in DECODERS:
        supported = ", ".join(f"{a} with {b}" for a, b in DECODERS)
        what = f"schema {schema.encoding!r}" if schema.encoding else "no schema"
        raise UserError(
            f"topic {channel.topic}: {what} with messages {channel.encoding!r} cannot be read,"
            f" record one of: {supported}"
        )
    try:
        if by_name:
            read = standard.reader(schema.name)
        else:
            read = _compiled(schema.encoding, channel.encoding, schema.name, schema.data)
    except Exception as error:  # the parsers raise many kinds
        reason = Unreadable.by(error)
        raise UserError(f"topic {channel.topic}: bad schema {schema.name} ({reason})") from error

    def bounded(payload: bytes) -> Message:
        if len(payload) > LONGEST:
            raise Unreadable("a message that is too long")
        try:
            return read(standard.plain(payload, LONGEST) if channel.encoding == "cdr" else payload)
        except Exception as error:  # damaged bytes make the libraries raise anything
            raise Unreadable.by(error) from error

    return bounded


def _says_nothing(schema: Schema) -> bool:
    """Whether a schema is no more than the name of a standard type of ROS 2."""
    if not standard.knows(schema.name):
        return False
    if schema.encoding in ("", "omgidl"):  # of DDS, whose names of ROS types are as well known
        return True
    return schema.encoding == "ros2msg" and schema.data.strip() in (b"", schema.name.encode())


def message_reader(decode: Decoder, read: Callable[[Message], Value]) -> Callable[[bytes], Value]:
    """Make a function from payload to what `read` takes of its message; it raises Unreadable."""

    def decoded(payload: bytes) -> Value:
        message = decode(payload)
        try:
            return read(message)
        except UNFIT as error:
            raise Unreadable.by(error) from error

    return decoded


@lru_cache(64)
def _compiled(kind: str, encoding: str, name: str, data: bytes) -> Decoder:
    return DECODERS[kind, encoding](Schema(id=1, name=name, encoding=kind, data=data))


def _ros(schema: Schema) -> Decoder:
    """Decoder by types of this schema alone, because recordings may mix versions of a type."""
    text = schema.data.decode()
    # As rosbags has it: with the `msg` that ROS 1 leaves out.
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
    ros1 = schema.encoding == "ros1msg"
    read = store.deserialize_ros1 if ros1 else store.deserialize_cdr
    return lambda payload: read(payload, name)


def _protobuf(schema: Schema) -> Decoder:
    decode = DecoderFactory().decoder_for("protobuf", schema)
    if decode is None:
        raise ValueError("no schema of protobuf")
    return decode


def _json(schema: Schema) -> Decoder:
    """Decoder by the schema's name alone: fields are found by name, bytes are base64."""
    return lambda payload: json.loads(payload, object_hook=lambda fields: SimpleNamespace(**fields))


DECODERS: dict[tuple[str, str], Callable[[Schema], Decoder]] = {
    ("ros2msg", "cdr"): _ros,
    ("ros2idl", "cdr"): _ros,
    ("ros1msg", "ros1"): _ros,
    ("protobuf", "protobuf"): _protobuf,
    ("jsonschema", "json"): _json,
}
