"""MCAP: intact messages come back, what is lost is said, no size or name in a file does harm."""

from __future__ import annotations

import gzip
import struct
import weakref
import zlib
from dataclasses import replace
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap import records as kinds
from mcap.data_stream import RecordBuilder
from mcap.writer import CompressionType, Writer

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.files import MAGIC, read_container
from sling2sim2real.recording.messages import Spool
from sling2sim2real.recording.streams import read_recording
from validation.recordings.bag import blind_bag, edit

START = 10**18
SCHEMA = kinds.Schema(id=1, data=b"float64 x", encoding="ros2msg", name="pkg/msg/Joints")


def channel(number: int = 1, topic: str = "/x", schema: int = 1) -> kinds.Channel:
    return kinds.Channel(number, topic, "cdr", {}, schema)


def message(k: int, number: int = 1, data: bytes = b"12345678") -> kinds.Message:
    time = START + k * 10**9
    return kinds.Message(channel_id=number, log_time=time, data=data, publish_time=time, sequence=k)


def packed(records) -> bytes:
    """Records as the library writes them; bytes are taken as they are."""
    parts = []
    for record in records:
        if isinstance(record, bytes):
            parts.append(record)
            continue
        builder = RecordBuilder()
        record.write(builder)
        parts.append(builder.end())
    return b"".join(parts)


def chunk(records, *, compression: str = "", crc: int | None = None, size: int | None = None):
    data = records if isinstance(records, bytes) else packed(records)
    body = {"": bytes, "zstd": zstandard.compress, "lz4": lz4.frame.compress}[compression](data)
    return kinds.Chunk(
        compression=compression,
        data=body,
        message_start_time=START + 3 * 10**9,
        message_end_time=START + 4 * 10**9,
        uncompressed_crc=zlib.crc32(data) if crc is None else crc,
        uncompressed_size=len(data) if size is None else size,
    )


END = (kinds.DataEnd(0), kinds.Footer(0, 0, 0))


def read(folder: Path, *records, end=END, magic: bytes = MAGIC):
    path = folder / "file.mcap"
    path.write_bytes(MAGIC + packed([kinds.Header("ros2", "test"), *records, *end]) + magic)
    return read_container(path)


def times(container, name: str = "/x") -> list[int]:
    topics = [topic for topic in container.topics if topic.name == name]
    return [(t - START) // 10**9 for topic in topics for t in topic.log_times]


def test_a_plain_file(tmp_path) -> None:
    """Also where its records come in another order, as long as what they are comes first."""
    for records in ([SCHEMA, channel()], [channel(), SCHEMA]):
        file = read(tmp_path, chunk([*records, message(0), message(1)]))
        assert times(file) == [0, 1] and (file.losses, file.notes) == ([], [])
        (topic,) = file.topics
        assert (topic.kind, topic.readings) == ("Joints", {})  # of a type that nobody reads


def frame_that_claims(size: int) -> kinds.Chunk:
    """A zstd frame whose header announces `size` bytes of content (RFC 8878, 3.1.1.1)."""
    head = struct.pack("<IBQ", 0xFD2FB528, 0b11100000, size)  # one segment, 8 bytes of size
    last_raw_block = struct.pack("<I", 1 | 3 << 3)[:3] + b"abc"
    bomb = chunk(b"abc", crc=1, size=2**29)
    return replace(bomb, compression="zstd", data=head + last_raw_block)


@pytest.mark.parametrize(
    "bad",
    [
        chunk([message(3)], crc=1),
        chunk([message(3)], size=2**62),
        chunk(packed([message(3)]) + b"\x05\xff"),  # ends within a record
        chunk([message(3)], compression="zstd", size=2**30 + 1),
        frame_that_claims(2**50),
        replace(chunk(b"", crc=1, size=100), compression="zstd", data=b"no frame"),
        replace(chunk(b"", crc=1, size=100), compression="lz4", data=b"no frame"),
    ],
)
def test_damaged_chunks_are_dropped_with_their_time(tmp_path, bad) -> None:
    first = chunk([SCHEMA, channel(), message(0)])
    file = read(tmp_path, first, bad, chunk([message(5)]))
    assert times(file) == [0, 5]
    assert file.losses == ["1 damaged chunk dropped: 3.00 to 4.00 s"]


def test_a_file_that_is_cut_is_read_up_to_there(tmp_path) -> None:
    whole = [chunk([SCHEMA, channel(), message(0)]), chunk([message(1)]), chunk([message(2)])]
    file = read(tmp_path, *whole[:2], packed(whole[2:])[:-5], end=[], magic=b"")
    assert times(file) == [0, 1]
    (loss,) = file.losses
    assert loss.startswith("cut off or damaged after 1.00 s, about byte ")
    file = read(tmp_path, *whole[:2], packed(whole[2:])[:-5])
    assert times(file) == [0, 1]
    assert file.losses[0].startswith("cut off or damaged after 1.00 s")


def test_the_checksum_of_an_unchunked_file(tmp_path) -> None:
    path = tmp_path / "file.mcap"
    written(path, 5, use_chunking=False, enable_data_crcs=True)
    contents = read_container(path)
    assert times(contents) == [0, 1, 2, 3, 4] and (contents.losses, contents.notes) == ([], [])
    path.write_bytes(path.read_bytes().replace(b"1234567\x03", b"1234568\x03", 1))
    assert read_container(path).losses == [
        "the checksum of all messages together does not hold: some are damaged"
    ]


@pytest.mark.parametrize("other", [SCHEMA, replace(SCHEMA, data=b"# of another\nfloat64   x")])
def test_one_topic_in_two_channels_is_one(tmp_path, other) -> None:
    """Also where schemas differ in a comment, as two files have it that were merged."""
    records = [SCHEMA, replace(other, id=2), channel(1), channel(2, schema=2)]
    file = read(tmp_path, chunk([*records, message(0, 1), message(1, 2)]))
    assert len(file.topics) == 1 and times(file) == [0, 1]


def test_messages_that_nothing_explains_are_passed_over(tmp_path) -> None:
    file = read(tmp_path, chunk([SCHEMA, channel(), message(0), message(1, 7)]))
    assert times(file) == [0]
    file = read(tmp_path, chunk([channel(schema=0), message(0)]))
    assert times(file) == [0] and file.topics[0].schema.name == "" and file.losses == []


def test_what_the_first_chunk_says_is_found_at_the_end(tmp_path) -> None:
    path = tmp_path / "file.mcap"
    written(path, 3, chunk_size=60)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"float64 x", b"float64 y", 1))  # in the first chunk
    file = read_container(path)
    assert times(file) == [1, 2] and "1 damaged chunk dropped" in file.losses[0]


def written(path: Path, count: int, **options) -> None:
    """By the library's writer."""
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE, **options)
        writer.start()
        schema = writer.register_schema("pkg/msg/X", "ros2msg", b"float64 x")
        number = writer.register_channel("/x", "cdr", schema)
        for k in range(count):
            writer.add_message(number, START + k * 10**9, b"1234567" + bytes([k]), START)
        writer.finish()


def test_the_count_of_the_file_is_compared(tmp_path) -> None:
    path = tmp_path / "file.mcap"
    written(path, 9, chunk_size=60)
    assert (read_container(path).losses, read_container(path).notes) == ([], [])
    content = bytearray(path.read_bytes())
    start = content.rindex(b"\x06", 0, content.index(b"1234567\x05") - 40)
    content[start] = 0x86  # a chunk that looks like a record of an application's own
    path.write_bytes(content)
    (loss,) = read_container(path).losses
    assert loss.endswith(" of the 9 messages that the file counts were read")


def test_a_damaged_end_costs_nothing(tmp_path) -> None:
    data = [chunk([SCHEMA, channel(), message(0)])]
    file = read(tmp_path, *data, end=[kinds.DataEnd(0), b"\x0b\xff\xff"])
    assert times(file) == [0] and file.losses == []


def test_memory_holds_no_picture() -> None:
    """Their bytes are let go, and come back from the file."""
    spool, sent = Spool(), [np.full(500 + k, k, np.uint8) for k in range(20)]
    held = [weakref.ref(data) for data in sent]
    retained = [spool.put(data) for data in sent]
    sent.clear()
    assert not any(ref() is not None for ref in held[:-1])
    for k, get in enumerate(retained):
        np.testing.assert_array_equal(get(), np.full(500 + k, k))


EVIL = "/../../x\x1b[2J\n\r\u202e<script>alert(1)</script>|`$(touch pwned)`"


def test_names_are_shown_without_what_a_terminal_obeys(tmp_path, params) -> None:
    shown = printable(EVIL)
    assert shown.isprintable() and "\\x1b[2J\\n\\r\\u202e<script>" in shown
    assert printable("/ft/wrench_é") == "/ft/wrench_é"
    for name in (EVIL, "y" * 10**6):
        pose = replace(SCHEMA, name=f"{name}/msg/PoseStamped")
        file = read(tmp_path, chunk([pose, channel(topic=name), message(0)]))
        assert file.topics[0].name == printable(name) and file.topics[0].schema.name.isprintable()
        with pytest.raises(UserError) as caught:
            read_recording(tmp_path / "file.mcap", params.setup)
        assert str(caught.value).isprintable() and len(str(caught.value)) < 2000

    def rename(stamp: int, message) -> None:
        message.header.frame_id = EVIL

    path = blind_bag(tmp_path, change=edit(pose=rename))
    assert read_recording(path, params.setup).pose.frame.isprintable()


@pytest.mark.parametrize(
    ("files", "given", "words"),
    [
        ({"my.mcap": b"version https://git-lfs.github.com/spec/v1"}, "my.mcap", "git lfs pull"),
        ({"my.mcap": b"#ROSBAG V2.0\n"}, "my.mcap", "a damaged ROS 1 bag"),
        ({"my.mcap": b"SQLite format 3\0"}, "my.mcap", "is no ROS 2 bag, or a damaged one"),
        ({"my.mcap": b"PK\x03\x04"}, "my.mcap", "ZIP"),
        ({"my.mcap": gzip.compress(MAGIC, mtime=0)}, "my.mcap", "packed by gzip: unpack it"),
        ({"my.mcap": zstandard.compress(MAGIC)}, "my.mcap", "packed by zstd: unpack it"),
        ({"my.mcap": lz4.frame.compress(MAGIC)}, "my.mcap", "packed by LZ4: unpack it"),
        ({"my.mcap": bytes(50)}, "my.mcap", "not an MCAP file"),
        ({"my.mcap": b""}, "my.mcap", "not an MCAP file"),
        ({}, "my.mcap", "no such file"),
        ({}, "", "is a folder without a recording"),
        ({"my_0.mcap": b""}, "", "is a folder without a recording"),
        ({"my_0.mcap": b"x" * 20}, "", "my_0.mcap: not an MCAP file"),
        ({"a.mcap": b"x", "b.mcap": b"x"}, "", "holds several recordings.* name one file: a.mcap"),
    ],
)
def test_what_is_no_recording_is_one_line(tmp_path, files, given, words) -> None:
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError, match=words) as caught:
        read_container(tmp_path / given)
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)
