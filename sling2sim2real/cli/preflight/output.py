"""Where pictures and timelines may be written."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sling2sim2real.base.errors import UserError


def expect_writable(path: Path, suffix: str) -> None:
    """Raises UserError where `path` cannot become a file of that kind."""
    if path.suffix.lower() != suffix:
        raise UserError(f"{path}: must end with {suffix}")
    if path.is_dir():
        raise UserError(f"{path}: is a folder, name a file in it")
    expect_folder(path)
    if path.exists() and not os.access(path, os.W_OK):
        raise UserError(f"{path}: may not be written here, choose another folder")


def expect_folder(path: Path) -> None:
    """Raises UserError where nothing can be made beside `path`."""
    if not path.parent.is_dir():
        raise UserError(f"{path}: there is no folder {path.parent}, make it first")
    if not os.access(path.parent, os.W_OK):
        raise UserError(f"{path}: may not be written here, choose another folder")


@contextmanager
def written(path: Path) -> Iterator[None]:
    """Raises UserError where writing `path` fails: a full disk, a strange file system."""
    try:
        yield
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error})") from error
