"""Files that are packed as a whole, or are something else by their first bytes."""

from __future__ import annotations

import gzip

import lz4.frame
import pytest
import zstandard

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.files import name_of, parts_of, read_container
from tests.recording.parts import metadata, split

PACKERS = {".zst": zstandard.compress, ".gz": gzip.compress, ".lz4": lz4.frame.compress}


def counts(path) -> dict[str, int]:
    return {channel.topic: len(channel.payloads) for channel in read_container(path).channels}


@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize("named", [True, False])
def test_a_packed_file_is_read_by_whatever_name(whole, tmp_path, suffix, named) -> None:
    path = tmp_path / (f"my.mcap{suffix}" if named else "my.mcap")
    path.write_bytes(PACKERS[suffix](whole.read_bytes()))
    assert counts(path) == counts(whole) and name_of(path) == "my"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    if suffix == ".zst":  # the file is one of its blocks
        with pytest.raises(UserError, match="cut off: copy it again"):
            read_container(path)
        return
    assert "the file has no end" in read_container(path).losses[0]


def test_a_split_bag_of_packed_parts(whole, tmp_path) -> None:
    parts = split(whole, tmp_path / "my", (1.0, 2.5))
    packed = [part.with_name(f"{part.name}.zstd") for part in parts]
    for part, other in zip(parts, packed, strict=True):
        other.write_bytes(zstandard.compress(part.read_bytes()))
        part.unlink()
    folder = parts[0].parent
    for given in (folder, packed[1]):
        assert parts_of(given) == packed and counts(given) == counts(whole)
        assert name_of(given) == "my"
    metadata(folder, *(part.name for part in packed))
    assert counts(folder) == counts(packed[2]) == counts(whole)
    parts[1].write_bytes(zstandard.decompress(packed[1].read_bytes()))  # unpacked by hand
    assert parts_of(folder) == [packed[0], parts[1], packed[2]]


@pytest.mark.parametrize(
    "first, message",
    [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0", "git lfs pull"),
        (b"#ROSBAG V2.0\n", "a damaged ROS 1 bag"),
        (b"SQLite format 3\0", "is no ROS 2 bag, or a damaged one"),
        (b"PK\x03\x04", "ZIP"),
        (bytes(50), "not an MCAP file"),
        (
            gzip.compress(b"version https://git-lfs", mtime=0),
            "what is packed in it is a Git LFS pointer",
        ),
    ],
)
def test_what_else_it_is(tmp_path, first, message) -> None:
    path = tmp_path / "my.mcap"
    path.write_bytes(first)
    with pytest.raises(UserError, match="my.mcap: ") as caught:
        read_container(path)
    assert message in str(caught.value)
