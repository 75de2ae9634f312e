"""ROS 2 messages without a schema of their own: standard types by name; and packed one by one.

Recorders that do not find the definitions write empty schemas, or names alone. The standard types
are the same in all distributions of today.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import zstandard
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

ZSTD = b"\x28\xb5\x2f\xfd"  # no header of CDR begins so
XCDR2 = range(0x06, 0x0C)  # second byte: OMG DDS-XTypes 1.3, table 60
PACKAGES = ("geometry_msgs", "sensor_msgs", "std_msgs", "tf2_msgs")


def name_of(schema: str) -> str:
    """a::msg::dds_::B_, as DDS has it, and a/B to a/msg/B."""
    package, kind = re.split("::|/", schema)[0], re.split("::|/", schema)[-1]
    return f"{package}/msg/{kind.removesuffix('_') if '::' in schema else kind}"


def knows(schema: str) -> bool:
    """Whether it is the name of a standard type."""
    name = name_of(schema)
    return name.startswith(PACKAGES) and name in _store().fielddefs


def reader(schema: str) -> Callable[[bytes], Any]:
    """Make a function from payload to message, of a standard type."""
    store, name = _store(), name_of(schema)
    return lambda payload: store.deserialize_cdr(payload, name)


def plain(payload: bytes, most: int) -> bytes:
    """Return a message's CDR, unpacked where zstd packed it.

    Raises ValueError where it is XCDR2, or unpacks to more than `most` bytes. The length of what
    is not packed is not checked.
    """
    if payload[:4] == ZSTD:  # ros2 bag record --compression-mode message
        with zstandard.ZstdDecompressor().stream_reader(payload) as stream:
            payload = stream.read(most + 1)
        if len(payload) > most:
            raise ValueError("a message that is too long")
    if len(payload) > 1 and not payload[0] and payload[1] in XCDR2:
        raise ValueError(
            "in XCDR2, record with a middleware that writes XCDR1, the default of ROS 2"
        )
    return payload


@lru_cache(1)
def _store() -> Typestore:
    return get_typestore(Stores.ROS2_HUMBLE)
