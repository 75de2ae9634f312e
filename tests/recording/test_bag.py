"""A bag's folder, split or not, is the recording that its parts make; bags of other kinds."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.files import name_of, once, parts_of, read_container, sha256
from sling2sim2real.recording.streams import read_recording
from tests.recording.parts import split
from tests.recording.test_foxglove import assert_same_recording
from validation.recordings.bag import blind_bag, messages_of, write_bag


@pytest.fixture
def parts(whole, tmp_path) -> list[Path]:
    return split(whole, tmp_path / "my", tuple(0.35 * k for k in range(1, 11)))


def test_a_split_bag_is_one_recording(whole, parts, params) -> None:
    """With /tf_static in its first part alone, by any of its parts, which are sorted by number."""
    wanted = read_recording(whole, params.setup)
    folder = parts[0].parent
    assert read_recording(parts[0], params.setup).notes[0].startswith("all 11 parts")
    for given in (folder, parts[0], parts[10]):
        assert_same_recording(read_recording(given, params.setup), wanted)
        assert (parts_of(given), name_of(given)) == (parts, "my")
    assert len({sha256(path) for path in (folder, *parts)}) == 1
    assert once([*parts, whole]) == [parts[0], whole]
    assert once([parts[10], folder, whole, whole]) == [parts[10], whole, whole]


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
    files = [tmp_path / f"june_{number}.mcap" for number in range(2)]
    assert [parts_of(file) for file in files] == [[file] for file in files] and once(files) == files
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
