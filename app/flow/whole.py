"""DVC's command line, which leaves dvc.lock and its own locks whole whatever ends it.

    python -P whole.py repro ...

DVC reads and writes all of dvc.lock for each stage that ran, in Python, and in place: with a
hundred stages for ten seconds, while every other DVC waits; Ctrl-C, a kill or a full disk would cut
it off, and no DVC command reads it then. Here the one entry is exchanged, by DVC's own writer, in a
file beside, which is then renamed. So is the file of its read and write locks.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from pipeline.base.files import replacing, write_text

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
        with replacing(path) as temporary, self._fs.open(str(temporary), mode, **more) as file:
            yield file


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

    def beside(path, data, dumper, fs=None, **more) -> None:
        with replacing(path) as temporary:
            in_place(str(temporary), data, dumper, fs, **more)

    def of_one(self, stages, **more) -> None:
        new: dict[str, dict] = {}
        for stage in stages:
            new |= to_lockfile(stage, **more)
        if write(self.path, new):
            self.repo.scm_context.track_file(self.relpath)
        else:
            of_all(self, stages, **more)

    _common._dump_data, Lockfile.dump_stages = beside, of_one
    return dvc()


def sign_locks() -> None:
    """Have DVC's hardlink locks say who holds them, which it hashes away: host and process.

    So `locks.mend` knows those of the dead. For this process.
    """
    import flufl.lock
    from dvc.lock import HardlinkLock

    HardlinkLock._set_claimfile = flufl.lock.Lock._set_claimfile


def write(lock: str | Path, new: Mapping[str, dict]) -> bool:
    """Put stages' entries into dvc.lock, by a caller that holds DVC's own lock.

    False, and nothing is written, where it is not as DVC writes it for stages alone.
    """
    lock = Path(lock)
    before = text = lock.read_text(encoding="utf-8") if lock.is_file() else HEAD
    for name, entry in new.items():
        text = None if text is None else put(text, name, entry)
    if text not in (before, None):
        write_text(lock, text)
    return text is not None


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
