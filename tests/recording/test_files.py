"""Recordings in every container: what is intact comes back, what is lost is said."""

from __future__ import annotations

import gzip
import sqlite3
import struct
import weakref
import zlib
from dataclasses import replace
from pathlib import Path

import foxglove
import lz4.frame
import numpy as np
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap import records as kinds
from mcap.data_stream import RecordBuilder
from mcap.writer import CompressionType, Writer
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording import files, images
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.files import MAGIC, name_of, parts_of, read_container, sha256
from sling2sim2real.recording.messages import Spool
from sling2sim2real.recording.streams import Recording, read_recording
from tests import once
from tests.recording.parts import split
from validation.recordings.bag import blind_bag, edit, messages_of, write_bag
from validation.recordings.foxglove_bag import translate
from validation.recordings.small import CONTAINERS, FAMILIES, small_params, write_small

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


END = packed([kinds.DataEnd(0), kinds.Footer(0, 0, 0)]) + MAGIC


def read(folder: Path, *records, end: bytes = END):
    path = folder / "file.mcap"
    path.write_bytes(MAGIC + packed([kinds.Header("ros2", "test"), *records]) + end)
    return read_container(path)


def times(container) -> list[int]:
    """Of the messages of the file's one topic."""
    (topic,) = container.topics
    return [(t - START) // 10**9 for t in topic.log_times]


def frame_that_claims(size: int) -> kinds.Chunk:
    """A zstd frame whose header announces `size` bytes of content (RFC 8878, 3.1.1.1)."""
    head = struct.pack("<IBQ", 0xFD2FB528, 0b11100000, size)  # one segment, 8 bytes of size
    last_raw_block = struct.pack("<I", 1 | 3 << 3)[:3] + b"abc"
    bomb = chunk(b"abc", crc=1, size=2**29)
    return replace(bomb, compression="zstd", data=head + last_raw_block)


KNOWN = SCHEMA, channel()
TWICE = SCHEMA, replace(SCHEMA, id=2, data=b"# of another\nfloat64   x"), channel()
LAST = packed([chunk([message(2)])])[:-5]
CUT = "cut off or damaged after 1.00 s, about byte "
DROPPED = "1 damaged chunk dropped: 3.00 to 4.00 s"
DAMAGED = (
    chunk([message(3)], crc=1),
    chunk([message(3)], size=2**62),
    chunk(packed([message(3)]) + b"\x05\xff"),  # ends within a record
    chunk([message(3)], compression="zstd", size=2**30 + 1),
    frame_that_claims(2**50),
    replace(chunk(b"", crc=1, size=100), compression="zstd", data=b"no frame"),
    replace(chunk(b"", crc=1, size=100), compression="lz4", data=b"no frame"),
)


@pytest.mark.parametrize(
    ("records", "end", "seen", "loss"),
    [
        ([chunk([*KNOWN, message(0), message(1)])], END, [0, 1], ""),
        ([chunk([*KNOWN[::-1], message(0)])], END, [0], ""),  # in another order
        # Merged files have a topic in several channels, whose schemas differ in a comment.
        ([chunk([*TWICE, channel(2, schema=2), message(0), message(1, 2)])], END, [0, 1], ""),
        ([chunk([*KNOWN, message(0), message(1, 7)])], END, [0], ""),  # of what nothing explains
        ([chunk([channel(schema=0), message(0)])], END, [0], ""),
        ([chunk([*KNOWN, message(0)])], packed([kinds.DataEnd(0), b"\x0b\xff\xff"]), [0], ""),
        *(
            ([chunk([*KNOWN, message(0)]), bad, chunk([message(5)])], END, [0, 5], DROPPED)
            for bad in DAMAGED
        ),
        *(
            ([chunk([*KNOWN, message(0)]), chunk([message(1)]), LAST], end, [0, 1], CUT)
            for end in (END, b"")
        ),
    ],
)
def test_what_is_intact_is_read_and_the_rest_is_said(tmp_path, records, end, seen, loss) -> None:
    file = read(tmp_path, *records, end=end)
    assert times(file) == seen and file.notes == []
    assert file.topics[0].readings == {}  # of a type that nobody reads
    assert file.losses == [] if not loss else file.losses[0].startswith(loss)


def test_the_checksum_of_an_unchunked_file(tmp_path) -> None:
    path = tmp_path / "file.mcap"
    plain(path, 5, use_chunking=False, enable_data_crcs=True)
    contents = read_container(path)
    assert times(contents) == [0, 1, 2, 3, 4] and (contents.losses, contents.notes) == ([], [])
    path.write_bytes(path.read_bytes().replace(b"1234567\x03", b"1234568\x03", 1))
    assert read_container(path).losses == [
        "the checksum of all messages together does not hold: some are damaged"
    ]


def test_what_the_first_chunk_says_is_found_at_the_end(tmp_path) -> None:
    path = tmp_path / "file.mcap"
    plain(path, 3, chunk_size=60)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"float64 x", b"float64 y", 1))  # in the first chunk
    file = read_container(path)
    assert times(file) == [1, 2] and "1 damaged chunk dropped" in file.losses[0]


def plain(path: Path, count: int, **options) -> None:
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
    plain(path, 9, chunk_size=60)
    assert (read_container(path).losses, read_container(path).notes) == ([], [])
    content = bytearray(path.read_bytes())
    start = content.rindex(b"\x06", 0, content.index(b"1234567\x05") - 40)
    content[start] = 0x86  # a chunk that looks like a record of an application's own
    path.write_bytes(content)
    (loss,) = read_container(path).losses
    assert loss.endswith(" of the 9 messages that the file counts were read")


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


@pytest.mark.parametrize("name", [EVIL, "y" * 10**6])
def test_names_are_shown_without_what_a_terminal_obeys(tmp_path, params, name) -> None:
    assert "\\x1b[2J\\n\\r\\u202e<script>" in printable(EVIL) and printable("/ft_é") == "/ft_é"
    pose = replace(SCHEMA, name=f"{name}/msg/PoseStamped")
    file = read(tmp_path, chunk([pose, channel(topic=name), message(0)]))
    assert file.topics[0].name == printable(name) and file.topics[0].schema.name.isprintable()
    with pytest.raises(UserError) as caught:
        read_recording(tmp_path / "file.mcap", params.setup)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 2000


def test_frames_are_shown_so_too(tmp_path, params) -> None:
    def rename(stamp: int, message) -> None:
        message.header.frame_id = EVIL

    path = blind_bag(tmp_path, change=edit(pose=rename))
    assert read_recording(path, params.setup).pose.frame.isprintable()


@pytest.mark.parametrize(
    ("contents", "named", "words"),
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
def test_what_is_no_recording_is_one_line(tmp_path, contents, named, words) -> None:
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError, match=words) as caught:
        read_container(tmp_path / named)
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)


@pytest.fixture
def parts(whole, tmp_path) -> list[Path]:
    return split(whole, tmp_path / "my", tuple(0.35 * k for k in range(1, 11)))


def test_a_split_bag_is_one_recording(whole, parts, params) -> None:
    """With /tf_static in its first part alone, by any of its parts, which are sorted by number."""
    wanted = read_recording(whole, params.setup)
    folder = parts[0].parent
    assert read_recording(parts[0], params.setup).notes[0].startswith("all 11 parts")
    for path in (folder, parts[0], parts[10]):
        assert_same_recording(read_recording(path, params.setup), wanted)
        assert (parts_of(path), name_of(path)) == (parts, "my")
    assert len({sha256(path) for path in (folder, *parts)}) == 1
    assert files.once([*parts, whole]) == [parts[0], whole]
    assert files.once([parts[10], folder, whole, whole]) == [parts[10], whole, whole]


RAW = "RIHS01_" + 64 * "0"
HUMBLE, NOETIC = get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS1_NOETIC)
TF = "geometry_msgs/TransformStamped[] transforms"
NOETIC.register(get_types_from_msg(TF, "tf2_msgs/msg/TFMessage"))


def written(folder: Path, whole: Path, plugin: StoragePlugin, own_types: bool) -> Path:
    """The file of a bag that rosbags writes of a recording; it names it, and writes metadata."""
    connections = {}
    with BagWriter(folder, version=9, storage_plugin=plugin) as bag:
        for schema, channel, message in messages_of(whole):
            if channel.topic not in connections:
                given = {"msgdef": schema.data.decode(), "rihs01": RAW}
                types = {"typestore": HUMBLE} if own_types else given
                connections[channel.topic] = bag.add_connection(channel.topic, schema.name, **types)
            bag.write(connections[channel.topic], message.log_time, message.data)
    suffix = {StoragePlugin.MCAP: "mcap", StoragePlugin.SQLITE3: "db3"}[plugin]
    return folder / f"{folder.name}.{suffix}"


@pytest.mark.parametrize("plugin", StoragePlugin)
@pytest.mark.parametrize("own_types", [True, False])
def test_the_bag_of_another_library(own_types, plugin, whole, tmp_path, params) -> None:
    folder = tmp_path / "other"
    file = written(folder, whole, plugin, own_types)
    assert parts_of(folder) == parts_of(file) == [file]
    assert_same_recording(read_recording(folder, params.setup), read_recording(whole, params.setup))
    assert sha256(folder) == sha256(file) and name_of(folder) == "other"


def test_a_file_of_sqlite_without_metadata_or_definitions(whole, tmp_path, params) -> None:
    """As Humble writes it; and one that is damaged or cut."""
    file = tmp_path / "alone.db3"
    written(tmp_path / "other", whole, StoragePlugin.SQLITE3, True).rename(file)
    base = sqlite3.connect(file)
    base.executescript("DROP TABLE message_definitions; UPDATE schema SET schema_version = 3")
    base.close()
    assert_same_recording(read_recording(file, params.setup), read_recording(whole, params.setup))
    assert name_of(file) == "alone"
    content = file.read_bytes()
    page = 4096 * (len(content) // 8192)
    for damaged in (
        content[:page] + bytes(4096) + content[page + 4096 :],
        content[: len(content) // 2],
        b"SQLite format 3\0" + bytes(100),
    ):
        file.write_bytes(damaged)
        with pytest.raises(UserError, match="alone.db3: is no ROS 2 bag, or a damaged one"):
            read_container(file)


def test_a_bag_of_ros_1(whole, tmp_path, params) -> None:
    file, connections = tmp_path / "my.bag", {}
    with Ros1Writer(file) as bag:
        for schema, channel, message in messages_of(whole):
            kind = schema.name
            if channel.topic not in connections:
                add = bag.add_connection
                connections[channel.topic] = add(channel.topic, kind, typestore=NOETIC)
            content = HUMBLE.deserialize_cdr(message.data, kind)
            data = NOETIC.serialize_ros1(as_ros1(content), kind)
            bag.write(connections[channel.topic], message.log_time, data)
    assert_same_recording(read_recording(file, params.setup), read_recording(whole, params.setup))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(UserError, match="my.bag: is a damaged ROS 1 bag .*: `rosbag reindex`"):
        read_container(file)


def as_ros1(content):
    """A message of ROS 2 with what ROS 1 has besides: the header's number; names in capitals."""
    if not hasattr(content, "__msgtype__"):
        return [as_ros1(part) for part in content] if isinstance(content, list) else content
    fields = {name: as_ros1(value) for name, value in vars(content).items()}
    if content.__msgtype__ == "std_msgs/msg/Header":
        fields["seq"] = 0
    if content.__msgtype__ == "sensor_msgs/msg/CameraInfo":
        fields |= {name.upper(): fields.pop(name) for name in "dkrp"}
    return NOETIC.types[content.__msgtype__](**fields)


def test_recordings_that_are_called_alike_stay_apart(tmp_path) -> None:
    """They were recorded minutes apart, or no first one is there."""
    late = tmp_path / "late.mcap"
    blind_bag(tmp_path).rename(tmp_path / "june_0.mcap")
    write_bag(late, cameras=False, rate=500, receive=lambda kind, t, delay: t + delay + 60)
    late.rename(tmp_path / "june_1.mcap")
    found = [tmp_path / f"june_{number}.mcap" for number in range(2)]
    assert [parts_of(file) for file in found] == [[file] for file in found] and files.once(
        found
    ) == found
    with pytest.raises(UserError, match="holds several recordings.* name one file: june_0.mcap"):
        parts_of(tmp_path)


def test_a_part_without_its_end_is_named_and_one_that_is_missing_refused(parts) -> None:
    """The recorder was killed."""
    folder = parts[0].parent
    parts[10].write_bytes(parts[10].read_bytes()[: parts[10].stat().st_size * 2 // 3])
    cut = read_container(folder).losses[0]
    assert cut.startswith("my_10.mcap: cut off or damaged after")
    parts[1].unlink()
    assert parts_of(parts[10]) == [parts[10]]
    with pytest.raises(UserError, match="not all parts of one, name one file: my_0.mcap, my_2"):
        parts_of(folder)


PARAMS = small_params()


@pytest.fixture(scope="session")
def small(tmp_path_factory) -> Path:
    """A folder of small recordings, one of each family in each container; to be read only."""

    def make(folder: Path) -> None:
        for family in FAMILIES:
            for container in CONTAINERS:
                write_small(folder / f"{family}-{container}.mcap", family, container)

    return once.folder(tmp_path_factory, "small", make)


def damaged(content: bytes, kind: str, place: float, value: int) -> bytes:
    """A file that was cut, in which a byte is another one, or in which a kilobyte is zero."""
    at = int(place * len(content))
    if kind == "cut":
        return content[:at]
    if kind == "byte":
        return content[:at] + bytes([content[at] ^ value]) + content[at + 1 :]
    return content[:at] + bytes(1000) + content[at + 1000 :]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    family=st.sampled_from(sorted(FAMILIES)),
    container=st.sampled_from(sorted(CONTAINERS)),
    kind=st.sampled_from(["cut", "byte", "zeros"]),
    place=st.floats(0.001, 0.999),
    value=st.integers(1, 255),
)
def test_damage_is_read_around_and_said(
    small, tmp_path, family, container, kind, place, value
) -> None:
    whole, path = small / f"{family}-{container}.mcap", tmp_path / "damaged.mcap"
    path.write_bytes(damaged(whole.read_bytes(), kind, place, value))
    try:
        recording = read_recording(path, PARAMS.setup)
        episode = build_episodes(path, "band1", PARAMS)[0][0]
    except UserError as error:
        assert str(path) in str(error) and str(error).isprintable()
        return
    sound = read_recording(whole, PARAMS.setup)
    if not recording.losses:
        assert_same_episode(episode, build_episodes(whole, "band1", PARAMS)[0][0])
    elif container != "unchunked":  # of which only one checksum tells, and not what is damaged
        for role, stream in recording.streams.items():
            places = np.searchsorted(sound.streams[role].stamp, stream.stamp)
            np.testing.assert_array_equal(sound.streams[role].stamp[places], stream.stamp)
            if role not in ("color", "depth"):
                values = sound.streams[role].values[places]
                np.testing.assert_array_equal(values, stream.values)


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_foxglove_schemas_give_the_same_episode(encoding, episode, seen, params, tmp_path) -> None:
    path = tmp_path / "foxglove.mcap"
    translate(seen[0], path, encoding)
    assert_same_episode(build_episodes(path, "band1", params)[0][0], episode)


def test_raw_pictures_are_what_the_packed_ones_hold(seen, params, tmp_path) -> None:
    """rgb8, and depth in metres."""
    path = tmp_path / "raw.mcap"
    translate(seen[0], path, "protobuf", raw=True)
    usual, raw = (read_recording(file, params.setup) for file in (seen[0], path))
    assert raw.color.values[0].encoding == "rgb8" and raw.depth.values[0].encoding == "32FC1"
    for role, decode in (("color", images.color), ("depth", images.depth)):
        ours, theirs = raw.streams[role].values, usual.streams[role].values
        assert len(ours) == len(theirs) > 50
        for picture, other in zip(ours[::10], theirs[::10], strict=True):
            np.testing.assert_array_equal(decode(picture), decode(other))


def assert_same_episode(episode: Episode, usual: Episode) -> None:
    for name in ("time", "position", "velocity", "force", "opening", "cloud_time", "camera"):
        np.testing.assert_allclose(getattr(episode, name), getattr(usual, name), atol=1e-12)
    assert episode.release_time == usual.release_time
    assert episode.grasp_time == usual.grasp_time
    assert len(episode.clouds) == len(usual.clouds)
    for ours, theirs in zip(episode.clouds, usual.clouds, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-6)


FOXGLOVE = {
    "zstd": {"compression": foxglove.mcap.MCAPCompression.Zstd},
    "lz4": {"compression": foxglove.mcap.MCAPCompression.Lz4},
    "none": {"compression": None},
    "without chunks": {"use_chunks": False},
    "without indexes": {
        "emit_summary_offsets": False,
        "emit_message_indexes": False,
        "emit_chunk_indexes": False,
        "emit_statistics": False,
        "repeat_channels": False,
        "repeat_schemas": False,
    },
}


@pytest.mark.parametrize("container", FOXGLOVE)
def test_every_container(container, blind, params, tmp_path) -> None:
    path = tmp_path / "other.mcap"
    translate(blind[0], path, "protobuf", **FOXGLOVE[container])
    assert_same_recording(*(read_recording(file, params.setup) for file in (path, blind[0])))


def assert_same_recording(recording: Recording, usual: Recording) -> None:
    assert recording.losses == usual.losses == []
    assert recording.streams.keys() == usual.streams.keys()
    for role, stream in usual.streams.items():
        np.testing.assert_array_equal(recording.streams[role].stamp, stream.stamp)
        assert recording.streams[role].topic == stream.topic
        if role not in ("color", "depth"):
            np.testing.assert_array_equal(recording.streams[role].values, stream.values)
    assert recording.transforms.frames == usual.transforms.frames
