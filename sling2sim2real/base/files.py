"""Whole files or none: everything is written to a temporary name and then renamed.

It is on the disk before it bears its name, and its name is there before anything goes on: what a
later run finds is whole after a power cut too.
"""

from __future__ import annotations

import glob
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from sling2sim2real.base.errors import UserError, refused

if TYPE_CHECKING:
    import numpy as np
    from pyarrow import Table


class NotMade(UserError):
    """A file that something else makes is missing, or not whole; by its place alone.

    Attributes:
        path: Of the file.
        problem: What is wrong with it.
    """

    def __init__(self, path: Path, problem: str = "missing") -> None:
        super().__init__(path, problem)
        self.path, self.problem = Path(path), problem

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}"


def made(path: Path) -> Path:
    """`path`, which must be a file. Raises NotMade."""
    if not path.is_file():
        raise NotMade(path)
    return path


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Give an empty folder beside `path`, which takes its place on success, whatever was there.

    What killed processes left of `path` is removed too. Raises UserError where the disk refuses.
    """
    path = Path(path)
    with _temporary(path) as temporary:
        temporary.mkdir()
        yield temporary
        for entry in (*temporary.rglob("*"), temporary):
            _sync(entry)
        shutil.rmtree(path, ignore_errors=True)
        os.replace(temporary, path)
        _sync(path.parent)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; rename it to `path` on success, remove it on failure.

    What killed processes left of `path` is removed too. Raises UserError where the disk refuses.
    """
    path = Path(path)
    with _temporary(path) as temporary:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
        _sync(path.parent)


@contextmanager
def _temporary(path: Path) -> Iterator[Path]:
    """A free name beside `path`; whatever bears it in the end is removed."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_abandoned(path)
        yield temporary
    except OSError as error:
        message = OSError(error.errno, error.strerror, str(path))  # not by its temporary name
        if not (line := refused(message)):
            raise
        raise UserError(line) from error
    finally:
        with suppress(OSError):  # on a disk that is fixed
            shutil.rmtree(temporary) if temporary.is_dir() else temporary.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Wait until a file's contents, or the names in a folder, are on the disk."""
    number = os.open(path, os.O_RDONLY)
    try:
        # A folder's: some network file systems know no such thing.
        with suppress(OSError) if path.is_dir() else nullcontext():
            os.fsync(number)
    finally:
        os.close(number)


def _remove_abandoned(path: Path) -> None:
    for left in path.parent.glob(f".{glob.escape(path.name)}.*.tmp"):
        owner = left.name.removeprefix(f".{path.name}.").removesuffix(".tmp")
        if owner.isdecimal() and not _alive(int(owner)):
            shutil.rmtree(left) if left.is_dir() else left.unlink(missing_ok=True)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)  # signal 0 asks only
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def read_table(path: Path) -> Table:
    """A Parquet file as a table; pyarrow's own `read_table` imports pandas first."""
    from pyarrow.parquet import ParquetFile

    with ParquetFile(path) as file:
        return file.read()


def column(table: Table, name: str) -> np.ndarray:
    """A table's column of numbers, of which none is null; its own `to_numpy` imports pandas too."""
    import numpy as np

    return np.array(np.from_dlpack(table[name].combine_chunks()))


def write_text(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, content: object) -> None:
    """Write `content` with sorted keys, so that equal content gives equal bytes."""
    write_text(path, json.dumps(content, indent=2, sort_keys=True, allow_nan=False) + "\n")
