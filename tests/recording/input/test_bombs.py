"""Small files that ask for much memory: pictures, and messages without end."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
import zstandard
from mcap.writer import Writer

from pipeline.recording.input.images import Undecodable, color, depth
from pipeline.recording.input.readings import Picture
from tests.project import ROOT

MOST = 2 * 2**30  # bytes
GIGANTIC = 65_500  # pixels a side, which JPEG and PNG allow


def jpeg(width: int, height: int) -> bytes:
    """A small picture whose header claims another size."""
    data = bytearray(cv2.imencode(".jpg", np.full((8, 8, 3), 90, np.uint8))[1].tobytes())
    at = data.index(b"\xff\xc0") + 5
    data[at : at + 4] = struct.pack(">HH", height, width)
    return bytes(data)


def png(width: int, height: int, bits: int, kind: int, *more: tuple[bytes, bytes]) -> bytes:
    """Whole chunks, of which the first claims a size."""
    head = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    chunks = [(b"IHDR", head), *more, (b"IDAT", zlib.compress(bytes(2**20))), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    )


def bomb() -> bytes:
    """A text chunk of a kilobyte or so that unpacks to a gigabyte."""
    packer = zlib.compressobj(9)
    return b"a\0\0" + b"".join(packer.compress(bytes(2**20)) for _ in range(2**10)) + packer.flush()


def raw(encoding: str, width: int, height: int, step: int) -> Picture:
    return Picture(encoding, "", np.zeros(100, np.uint8), height, width, step)


def packed(format: str, data: bytes) -> Picture:
    return Picture("", format, np.frombuffer(data, np.uint8))


COLORS = {
    "jpeg": lambda: packed("jpeg", jpeg(GIGANTIC, GIGANTIC)),
    "png": lambda: packed("png", png(GIGANTIC, GIGANTIC, 8, 2)),
    "png-wide": lambda: packed("png", png(2**31 - 1, 1, 8, 2)),
    "raw": lambda: raw("rgb8", GIGANTIC, GIGANTIC, 3 * GIGANTIC),
    "raw-step": lambda: raw("rgb8", 4, 4, 2**62),
    "raw-none": lambda: raw("rgb8", 2**31, 2**31, 0),
}
DEPTHS = {
    "png": lambda: packed("16UC1; compressedDepth png", bytes(12) + png(GIGANTIC, GIGANTIC, 16, 0)),
    "rvl": lambda: packed(
        "16UC1; compressedDepth rvl", bytes(12) + struct.pack("<II", 2**20, 2**20)
    ),
    "raw": lambda: raw("16UC1", GIGANTIC, GIGANTIC, 2 * GIGANTIC),
    "metres": lambda: raw("32FC1", 2**31, 2**31, 2**33),
}
PEAK = """\
from tests.recording.input import test_bombs as bombs
for pictures, decode in ((bombs.COLORS, bombs.color), (bombs.DEPTHS, bombs.depth)):
    for name, make in pictures.items():
        try:
            print(name, "is a picture", decode(make()).shape)
        except bombs.Undecodable as error:
            assert str(error).isprintable(), name
small = bombs.packed("png", bombs.png(64, 64, 8, 2, (b"zTXt", bombs.bomb())))
try:
    assert bombs.color(small).shape == (64, 64, 3)
except bombs.Undecodable:
    pass
held = open("/proc/self/status").read().split("VmHWM:")[1].split()[0]  # no memory of who began it
print("peak", 1024 * int(held))
"""


def run(code: str, *arguments: object) -> list[str]:
    """Lines of a process of its own, whose memory counts alone."""
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    return done.stdout.splitlines()


def test_no_header_of_a_picture_gets_its_memory() -> None:
    (peak,) = run(PEAK)
    assert int(peak.split()[1]) < MOST / 2  # the smallest of them asks for eight gigabytes


@pytest.mark.parametrize("decode", [color, depth])
def test_a_picture_of_nothing_is_refused(decode) -> None:
    with pytest.raises(Undecodable):
        decode(packed("png", b""))


# Of each file in a folder what is read or why it is refused.
READ = """\
import sys
from pathlib import Path
from pipeline.base.errors import UserError
from pipeline.recording.input.container import read_container
for path in sorted(Path(sys.argv[1]).glob("*.mcap")):
    try:
        found = read_container(path)
        print(path.stem, sum(len(c.payloads) for c in found.channels), *found.losses)
    except UserError as error:
        print(path.stem, "refused", error)
held = open("/proc/self/status").read().split("VmHWM:")[1].split()[0]  # no memory of who began it
print("peak", 1024 * int(held))
"""


@pytest.mark.slow
def test_ten_million_tiny_messages_are_refused_in_one_line(tmp_path: Path) -> None:
    """31 bytes each in a chunk that packs to kilobytes, and more of memory."""
    path, count = tmp_path / "tiny.mcap", 10_000_000
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start("ros2")
        schema = writer.register_schema("geometry_msgs/msg/WrenchStamped", "ros2msg", b"")
        channel = writer.register_channel("/ft", "cdr", schema)
        data = struct.pack("<BQHIQQ", 5, 22, channel, 0, 1, 1) * count
        small = zstandard.ZstdCompressor().compress(data)
        head = struct.pack("<QQQII", 1, 1, len(data), zlib.crc32(data), 4) + b"zstd"
        record = head + struct.pack("<Q", len(small)) + small
        file.write(struct.pack("<BQ", 6, len(record)) + record)
    assert path.stat().st_size < 2**20
    line, peak = run(READ, tmp_path)
    assert "holds more than 1 GiB of messages" in line and str(path) in line
    assert int(peak.split()[1]) < MOST
