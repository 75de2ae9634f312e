"""A recording on disk: an MCAP file, or the folder of a ROS 2 bag whose parts are one recording.

`ros2 bag record -o my` makes the folder my/ with metadata.yaml and my_0.mcap; where it splits the
bag, with my_1.mcap and so on. /tf_static is in the first part alone.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from mcap.records import Chunk, Message
from ruamel.yaml import YAML, YAMLError

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.input.opened import is_mcap, opened
from sling2sim2real.recording.input.records import DAMAGE, records

METADATA, SUFFIX = "metadata.yaml", ".mcap"
PACKED = re.compile(r"\.(zstd?|gz|lz4)$")  # behind it, where the whole file is packed
NUMBERED = re.compile(r"(.*)_(\d{1,6})")
GAP = 1.0  # s: a recorder that splits its bag pauses for less, people who record anew for more
NAMED = 5  # files named in an error


def parts_of(path: Path) -> list[Path]:
    """The MCAP files that are one recording, in order.

    Of a folder those that its metadata.yaml lists and that are there; without it all, by number.
    A file that is one of a split bag's parts stands for all of them.

    Raises:
        UserError: There is no recording, or a folder holds several.
    """
    path = Path(path)
    try:
        if path.is_dir():
            return _in_folder(path)
        _expect_file(path)
        numbered = _numbered(path)
        return (numbered and _beside(path, numbered[1])) or [path]
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error


def metadata_of(path: Path) -> list[Path]:
    """The file that lists a bag's parts, where there is one."""
    parts = parts_of(path)
    file = parts[0].with_name(METADATA)
    return [file] if file.is_file() and parts[0] in _listed_files(file.parent) else []


def missing_parts(path: Path) -> list[str]:
    """List, in words, the parts of a bag that are not there. As `parts_of`."""
    parts = parts_of(path)
    if metadata_of(path):
        folder = parts[0].parent
        gone = [name for name in _listed(folder) if not _there(folder / name).is_file()]
        return [f"{name}, which {METADATA} lists, is missing" for name in gone]
    numbers = [_number(part) for part in parts]
    if len(parts) < 2:
        return []
    gone = sorted({*range(max(numbers) + 1)} - {*numbers})
    return [f"part {number} of the bag is missing" for number in gone]


def once(paths: Iterable[Path]) -> list[Path]:
    """List each recording once, where files are parts of one: the first that names it."""
    unique: list[Path] = []
    seen: set[Path] = set()
    for path in paths:
        parts = parts_of(path)
        if len(parts) == 1 or parts[0] not in seen:
            unique.append(path)
        seen.update(parts)
    return unique


def name_of(path: Path) -> str:
    """What a recording is called: a bag by its folder, or by what its parts have in common."""
    path = Path(path)
    if path.is_dir():
        return path.resolve().name.removesuffix(SUFFIX)
    numbered = _numbered(path)
    return numbered[1] if numbered and len(parts_of(path)) > 1 else _stem(path)


def sha256(path: Path) -> str:
    """Hash of the file, also where it is a bag's only one; of several parts, of their hashes."""
    digests = []
    for part in parts_of(path):
        with part.open("rb") as file:
            digests.append(hashlib.file_digest(file, "sha256").hexdigest())
    if len(digests) == 1:
        return digests[0]
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


def _expect_file(path: Path) -> None:
    if not path.exists():
        raise UserError(f"{path}: no such file")
    if not path.is_file():
        raise UserError(f"{path}: is not a file")
    if not path.stat().st_size:
        raise UserError(f"{path}: is empty, record it again")


def _in_folder(folder: Path) -> list[Path]:
    files = [file for file in _files(folder) if file.stat().st_size]
    if (folder / METADATA).is_file():
        listed = _listed_files(folder)
        parts = [file for file in listed if file in files]
        if not parts:
            names = ", ".join(file.name for file in listed[:NAMED]) or "no file"
            raise UserError(
                f"{folder}: {METADATA} lists {names}, of which no {SUFFIX} file is there"
                " (ros2 bag record -s mcap writes one)"
            )
        return parts
    if not files:
        raise UserError(
            f"{folder}: is a folder without an MCAP file (ros2 bag record -s mcap writes one)"
        )
    if len(files) == 1:
        return files
    stems = {numbered[1] for file in files if (numbered := _numbered(file))}
    parts = sorted(files, key=_number)
    if len(stems) == 1 and min(map(_number, files)) >= 0 and _follow(parts):
        return parts
    names = ", ".join(sorted(file.name for file in files)[:NAMED])
    raise UserError(f"{folder}: holds several recordings, name one of them: {names}")


def _beside(path: Path, stem: str) -> list[Path] | None:
    """All parts of the split bag that this file is of; None where it is of none."""
    folder = path.parent
    parts = [file for file in _files(folder) if (m := _numbered(file)) and m[1] == stem]
    if len(parts) < 2:
        return None
    if (folder / METADATA).is_file() and path in _listed_files(folder):
        return _in_folder(folder)
    parts.sort(key=_number)
    return parts if _number(parts[0]) == 0 and _follow(parts) else None


def _stem(path: Path) -> str:
    """Its name without what says that it is an MCAP file, and packed."""
    return PACKED.sub("", path.name).removesuffix(SUFFIX)


def _files(folder: Path) -> list[Path]:
    """MCAP files by their names, each once where it lies packed beside itself."""
    files = [file for file in folder.glob(f"*{SUFFIX}*") if file.is_file()]
    files = [file for file in files if PACKED.sub("", file.name).endswith(SUFFIX)]
    return sorted({_there(file) for file in files})


def _there(file: Path) -> Path:
    """The file, or what was unpacked of it."""
    plain = file.with_name(PACKED.sub("", file.name))
    return plain if plain.is_file() else file


def _numbered(file: Path) -> re.Match[str] | None:
    """The bag's name and the part's number, of a file that is named like a part."""
    return NUMBERED.fullmatch(_stem(file))


def _number(file: Path) -> int:
    numbered = _numbered(file)
    return int(numbered[2]) if numbered else -1


def _listed(folder: Path) -> list[str]:
    """Names of the files in a bag's metadata, by number. Raises UserError."""
    path = folder / METADATA
    try:
        content = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        listed = [printable(Path(str(name)).name) for name in names]
    except (YAMLError, ValueError, RecursionError, KeyError, TypeError) as error:
        raise UserError(
            f"{path}: is no metadata of a ROS 2 bag; without it the {SUFFIX} files are taken by"
            " number: remove it, or `ros2 bag reindex` the bag"
        ) from error
    return sorted(dict.fromkeys(listed), key=lambda name: _number(Path(name)))


def _listed_files(folder: Path) -> list[Path]:
    """The files that a bag's metadata lists, there or not. Raises UserError."""
    return [_there(folder / name) for name in _listed(folder)]


def _follow(parts: list[Path]) -> bool:
    """Whether each part begins where the one before it ends."""
    spans = [_span(part, part.stat().st_mtime_ns) for part in parts]
    for before, after in zip(spans, spans[1:], strict=False):
        if before is None or after is None or abs(after[0] - before[1]) > GAP * 1e9:
            return False
    return True


@lru_cache(maxsize=64)
def _span(part: Path, _written: int) -> tuple[int, int] | None:
    """Log times of the first and of the last message [ns], as its chunks say; None: no MCAP."""
    times: list[int] = []
    if not is_mcap(part):
        return None
    with opened(part) as file, suppress(*DAMAGE):
        for record in records(file):
            if isinstance(record, Chunk) and record.message_end_time:
                times += (record.message_start_time, record.message_end_time)
            elif isinstance(record, Message):
                times.append(record.log_time)
    return (min(times), max(times)) if times else None
