"""A place for the caches of libraries where the user has none: no HOME, no name, a full disk.

Containers start with a user's number alone, `docker -u 1234`. Warp, Matplotlib, DVC and others keep
compiled kernels, fonts and states under HOME, or make a folder that is called `~`.
"""

from __future__ import annotations

import getpass
import os
import shutil
import tempfile
from pathlib import Path

from pipeline.base.errors import UserError

PROJECT = Path(__file__).parents[2]
ROOM = 50_000_000  # bytes, of compiled kernels and of lists of fonts
DVC = "/var/tmp/dvc"  # where DVC keeps what it knows of files, unless DVC_SITE_CACHE_DIR is set


def settle() -> None:
    """See to it in our environment, and so in that of all that we start; once is enough.

    Raises:
        UserError: No folder at all takes files.
    """
    if not os.path.isabs(os.path.expanduser("~")):
        os.environ["HOME"] = str(_elsewhere())
    user_cache = os.environ.get("XDG_CACHE_HOME", "")
    cache = Path(user_cache if os.path.isabs(user_cache) else os.path.expanduser("~/.cache"))
    if not all(map(_has_room, (cache, cache / "warp", cache / "matplotlib"))):
        os.environ["XDG_CACHE_HOME"] = str(_elsewhere())
    if not _has_room(Path(os.environ.get("MPLCONFIGDIR") or os.path.expanduser("~/.config"))):
        os.environ["MPLCONFIGDIR"] = str(_elsewhere() / "matplotlib")
    if "DVC_SITE_CACHE_DIR" not in os.environ and not _has_room(Path(DVC, "repo")):
        os.environ["DVC_SITE_CACHE_DIR"] = str(_elsewhere() / "dvc")
    try:
        getpass.getuser()
    except (KeyError, OSError):  # no entry among the users: no name
        os.environ["USER"] = str(os.getuid())


def _elsewhere() -> Path:
    """The project's .cache, else a temporary folder that is the user's alone."""
    if (PROJECT / "params.yaml").is_file() and _has_room(PROJECT / ".cache"):
        return PROJECT / ".cache"
    try:
        folder = Path(tempfile.gettempdir(), f"sling2sim2real-{os.getuid()}")
    except FileNotFoundError:
        raise UserError(
            "neither your home, nor the project, nor a temporary folder can be written: set TMPDIR"
            " to a folder that can"
        ) from None
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if status.st_uid == os.getuid() and status.st_mode & 0o777 == 0o700 and folder.is_dir():
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="sling2sim2real-"))  # the name is taken by another user


def _has_room(folder: Path) -> bool:
    """Whether a folder, which may have to be made, takes files."""
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    try:
        return os.access(folder, os.W_OK | os.X_OK) and shutil.disk_usage(folder).free > ROOM
    except OSError:
        return False
