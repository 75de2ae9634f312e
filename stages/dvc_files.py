"""What killed DVC commands leave behind and DVC itself does not clear: locks, half files.

Both the flow and a stage that DVC runs clear up by it.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path

from pipeline.base.files import write_json, write_text

COPIES = (".dvc/cache", "data", "reports")  # where DVC copies to
HALF = re.compile(r"\.[\w-]{22}\.tmp")  # what it calls a file until it has copied it to the end
ENTRY = re.compile(r"^  [^ ]", re.MULTILINE)  # where a stage's entry of dvc.lock begins


def half_files(root: Path) -> Iterator[Path]:
    """What DVC has not copied to the end."""
    for top in COPIES:
        for folder, _, names in os.walk(root / top):
            yield from (Path(folder, name) for name in names if HALF.fullmatch(name))


def mend(root: Path) -> None:
    """Clear up in a working copy, as far as no living DVC holds it."""
    from dvc.config import Config
    from dvc.exceptions import DvcException
    from dvc.lock import Lock, make_lock

    folder = Path(root, ".dvc", "tmp")
    if not folder.is_dir():  # no DVC was here
        return

    def lock(name: str):
        path = folder / name
        if hardlink and path.is_file() and path.stat().st_nlink == 1:
            with Lock(
                str(path)
            ):  # of the other kind, whose files stay behind: a link cannot be made
                path.unlink()
        return make_lock(str(path), tmp_dir=str(folder), hardlink_lock=hardlink)

    try:
        hardlink = Config(str(folder.parent))["core"].get("hardlink_lock", False)
        with lock("lock"):  # whoever copies, or writes dvc.lock, holds it
            _cut_back(Path(root, "dvc.lock"))
            for file in [*half_files(root)]:
                file.unlink(missing_ok=True)
        with lock("rwlock.lock"):
            _release(folder / "rwlock")
    except DvcException:  # such as that a DVC is at work: it is for the graph to say so
        return


def _cut_back(path: Path) -> None:
    """Drop the stage's entry in which dvc.lock ends too early; no DVC command reads it else.

    DVC writes it in place, so a kill, Ctrl-C or a full disk cuts it off. What it no longer names
    DVC finds in its cache of runs.
    """
    if not path.is_file():
        return
    text = path.read_text(encoding="utf-8", errors="replace")
    if _is_valid(text):
        return
    begins = [match.start() for match in ENTRY.finditer(text)]
    head = text[: begins[-1]] if begins else ""
    if len(begins) < 2:
        path.unlink()
    elif _is_valid(head):  # else it is damaged otherwise: the user's to mend, as DVC will say
        write_text(path, head)


def _is_valid(text: str) -> bool:
    """Whether DVC would read this dvc.lock."""
    from dvc.dvcfile import Lockfile
    from dvc.exceptions import DvcException
    from dvc.utils.serialize import parse_yaml

    try:
        Lockfile.validate(parse_yaml(text, "dvc.lock"), "dvc.lock")
    except DvcException:
        return False
    return True


def _release(path: Path) -> None:
    """Release the paths that no living DVC holds.

    DVC forgets holders whose process has gone. It trips over a file that a full disk cut off, and
    over a number that another process bears today, as after the restart of a container.
    """
    if not path.is_file():
        return
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        writers = {locked: who for locked, who in held.get("write", {}).items() if _lives(who)}
        readers = {locked: [*filter(_lives, who)] for locked, who in held.get("read", {}).items()}
    except (ValueError, AttributeError, TypeError, KeyError):
        path.unlink()
        return
    readers = {locked: who for locked, who in readers.items() if who}
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
