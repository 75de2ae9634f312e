"""What killed DVC commands leave behind and DVC itself does not clear: locks, half copies."""

from __future__ import annotations

import json
import re
import socket
from pathlib import Path

from app.flow import whole
from pipeline.base.files import write_json

COPIES = (".dvc/cache", "data", "reports")  # where DVC copies to
HALF = re.compile(r"\.[\w-]{22}\.tmp")  # its names of what it has not copied to the end


def mend(root: Path) -> None:
    """Clear up in a working copy. Call it while no other flow runs there."""
    from dvc.config import Config
    from dvc.exceptions import DvcException
    from dvc.lock import make_lock

    folder = Path(root, ".dvc", "tmp")

    def lock(name: str):
        if hardlink:
            _free(folder / name)
        return make_lock(str(folder / name), tmp_dir=str(folder), hardlink_lock=hardlink)

    whole.sign_locks()
    try:
        hardlink = Config(str(folder.parent))["core"].get("hardlink_lock", False)
        with lock("lock"):  # whoever copies holds it
            for file in (file for top in COPIES for file in Path(root, top).rglob(".*.tmp")):
                if HALF.fullmatch(file.name):
                    file.unlink(missing_ok=True)
        with lock("rwlock.lock"):
            _release(folder / "rwlock")
    except DvcException:  # such as that a DVC is at work: it is for the graph to say so
        return


def _free(path: Path) -> None:
    """Make room for a hardlink lock, whose name must not be there. Raises DVC's LockError.

    DVC's other kind of lock leaves its file behind; a hardlink lock is left by who was killed. Who
    holds one on another machine, or did not sign it (whole.sign_locks), is not known here.
    """
    import psutil
    from dvc.lock import Lock

    try:
        said = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return
    _, *holder = said.rsplit("|", 3)
    if len(holder) == 3:
        host, pid, _ = holder
        if host == socket.gethostname() and not psutil.pid_exists(int(pid)):
            path.unlink()
            path.with_name(Path(said).name).unlink(missing_ok=True)
    elif not said or said.strip().isdecimal():
        with Lock(str(path)):  # unless it is held
            path.unlink()


def _release(path: Path) -> None:
    """Release the paths that no living DVC holds.

    DVC forgets holders whose process has gone. It trips over a file that a full disk cut off, and
    over a number that another process bears today, as after the restart of a container.
    """
    if not path.is_file():
        return
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        writers = {one: who for one, who in held.get("write", {}).items() if _lives(who)}
        readers = {one: [*filter(_lives, who)] for one, who in held.get("read", {}).items()}
    except (ValueError, AttributeError, TypeError, KeyError):
        path.unlink()
        return
    readers = {one: who for one, who in readers.items() if who}
    if (writers, readers) != (held.get("write", {}), held.get("read", {})):
        write_json(path, {"write": writers, "read": readers})


def _lives(holder: dict) -> bool:
    """Whether the process of a holder is the DVC command that it was."""
    import psutil

    try:
        words = psutil.Process(holder["pid"]).cmdline()
    except psutil.NoSuchProcess:
        return False
    except psutil.AccessDenied:
        return True
    return holder["cmd"].partition(" ")[2] in " ".join(words)  # `python -m` renames the first
