"""Whether a project can be written: asked before a command changes anything in it.

What fails later without rarely says so.
"""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

from sling2sim2real.base.errors import UserError, refused

ROOM = 1_000_000  # bytes at least, with which DVC, Prefect and their locks can write
WRITTEN = ("dvc.lock", ".dvc/tmp", ".dvc/cache", "data", "reports")  # by stages and by DVC


def expect_room(folder: Path) -> None:
    """Raises UserError where the disk of `folder` is full."""
    if shutil.disk_usage(folder).free < ROOM:
        raise UserError(refused(OSError(errno.ENOSPC, "", str(folder))))


def with_disk(reason: str, folder: Path) -> str:
    """Why something failed, and that the disk of `folder` is full where it is and goes unsaid."""
    try:
        expect_room(folder)
    except UserError as full:
        return reason if os.strerror(errno.ENOSPC) in reason else f"{reason}; {full}"
    return reason


def expect_writable(*paths: Path) -> None:
    """Raises UserError where one of them, or the folder that is to hold it, cannot be written."""
    for path in paths:
        there = path
        while not os.path.lexists(there) and there != there.parent:
            there = there.parent
        if not os.access(there, os.W_OK | os.X_OK if there.is_dir() else os.W_OK):
            fixed = os.statvfs(there).f_flag & os.ST_RDONLY
            what = errno.EROFS if fixed else errno.EACCES
            raise UserError(refused(OSError(what, "", str(there))))


def expect_ready(root: Path) -> None:
    """Have DVC work in a project. Raises UserError where stages could not write what they make."""
    expect_writable(root, *(root / name for name in WRITTEN))
    expect_room(root)
    folders = (root.resolve(), *root.resolve().parents)
    with_git = any((folder / ".git").exists() for folder in folders)
    if (root / ".dvc").is_dir() and not with_git:  # it was unpacked from a ZIP
        without_git = ("config", "--local", "core.no_scm", "true")
        subprocess.run([sys.executable, "-P", "-m", "dvc", *without_git], cwd=root, check=True)
