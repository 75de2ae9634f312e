"""Whether a disk has room; for what fails without it rarely says so."""

from __future__ import annotations

import os
import shutil
from errno import ENOSPC
from pathlib import Path

from pipeline.base.errors import UserError

ROOM = 1_000_000  # bytes at least, with which Prefect's server, DVC and their locks can write


def expect_room(folder: Path) -> None:
    """Raises UserError where the disk of `folder` is full."""
    if shutil.disk_usage(folder).free < ROOM:
        raise UserError(f"{folder}: cannot be written ({os.strerror(ENOSPC)})")


def with_disk(reason: str, folder: Path) -> str:
    """Why something failed, and that the disk of `folder` is full where it is and goes unsaid."""
    try:
        expect_room(folder)
    except UserError as full:
        return reason if os.strerror(ENOSPC) in reason else f"{reason}; {full}"
    return reason
