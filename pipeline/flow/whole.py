"""DVC's command line, which leaves dvc.lock and its own locks whole whatever ends it.

    python -P whole.py repro ...

DVC reads and writes all of dvc.lock for each stage that ran, in Python, and in place: with a
hundred stages for ten seconds, while every other DVC waits; Ctrl-C, a kill or a full disk would cut
it off, and no DVC command reads it then. Here the one entry is exchanged, by DVC's own writer, in a
file beside, which is then renamed. So is the file of its read and write locks.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

HEAD = "schema: '2.0'\nstages:\n"


class Renaming:
    """A file system of DVC's that writes files beside, and renames them when they are whole."""

    def __init__(self, fs) -> None:
        self._fs = fs

    def __getattr__(self, name: str):
        return getattr(self._fs, name)

    @contextmanager
    def open(self, path: str, mode: str = "r", **more) -> Iterator:
        if mode != "w":
            with self._fs.open(path, mode, **more) as file:
                yield file
            return
        temporary = f"{path}.tmp"
        try:
            with self._fs.open(temporary, mode, **more) as file:
                yield file
            os.replace(temporary, path)
        except BaseException:
            with suppress(OSError):
                os.remove(temporary)
            raise


def main() -> int:
    """Run DVC with the arguments of this process; returns its exit status."""
    from dvc import rwlock
    from dvc.cli import main as dvc
    from dvc.dvcfile import Lockfile
    from dvc.stage.serialize import to_lockfile
    from dvc.utils.serialize import _common

    sign_locks()
    edit = rwlock._edit_rwlock
    rwlock._edit_rwlock = lambda folder, fs, hardlink: edit(folder, Renaming(fs), hardlink)
    in_place, of_all = _common._dump_data, Lockfile.dump_stages

    def replacing(path, data, dumper, fs=None, **more) -> None:
        temporary = f"{path}.tmp"  # DVC's own lock keeps others away; the next one writes over it
        in_place(temporary, data, dumper, fs, **more)
        sync(temporary)
        os.replace(temporary, path)

    def of_one(self, stages, **more) -> None:
        path = Path(self.path)
        text = path.read_text(encoding="utf-8") if path.exists() else HEAD
        for stage in stages:
            for name, entry in to_lockfile(stage, **more).items():
                text = None if text is None else put(text, name, entry)
        if text is None:
            return of_all(self, stages, **more)
        replacing(path, text, lambda data, file: file.write(data))
        self.repo.scm_context.track_file(self.relpath)

    _common._dump_data, Lockfile.dump_stages = replacing, of_one
    return dvc()


def sync(path: str | Path) -> None:
    """Have a file on the disk: renamed before that, it may be empty after a power cut."""
    with open(path, "r+b") as file:
        os.fsync(file.fileno())


def sign_locks() -> None:
    """Have DVC's hardlink locks say who holds them, which it hashes away: host and process.

    So `locks.mend` knows those of the dead. For this process.
    """
    import flufl.lock
    from dvc.lock import HardlinkLock

    HardlinkLock._set_claimfile = flufl.lock.Lock._set_claimfile


def put(text: str, name: str, entry: dict) -> str | None:
    """The text of dvc.lock with a stage's entry exchanged or added, to the byte as DVC has it.

    None where the file is not as DVC writes it for stages alone.
    """
    from dvc.utils.serialize import dumps_yaml

    if not text.startswith(HEAD) or re.search(r"^[^ ]", text[len(HEAD) :], re.MULTILINE):
        return None
    block = dumps_yaml({"stages": {name: entry}}).removeprefix("stages:\n")
    key = block[: block.index("\n") + 1]
    begin = text.find(f"\n{key}") + 1
    if not begin:
        return text + block
    following = re.compile(r"^  [^ ]", re.MULTILINE).search(text, begin + len(key))
    return text[:begin] + block + (text[following.start() :] if following else "")


if __name__ == "__main__":
    sys.exit(main())
