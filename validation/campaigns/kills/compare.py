"""What a command has made and left: files, DVC's cache and locks."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
from pathlib import Path

import psutil
from ruamel.yaml import YAML

PASSING = {".git", ".dvc", "__pycache__", ".prefect", "logs", ".checkpoints"}  # without results
ELSEWHERE = {"run.js", "dvc.lock"}  # when and where it ran; the order of its entries is chance
MADE = ("data", "reports", "params.yaml")
LOCKS = (".dvc/tmp/lock", ".dvc/tmp/rwlock.lock", ".dvc/tmp/flow.lock")


def contents(folder: Path) -> dict[str, str]:
    """Digest of every file of a working copy, by its path, but temporaries (half by name).

    DVC's own, Git's, Python's and Prefect's files and what searches keep do not count.
    """
    digests = {}
    for at, folders, names in os.walk(folder):
        folders[:] = [
            inner for inner in folders if inner not in PASSING and not inner.endswith(".tmp")
        ]
        for name in names:
            if name not in ELSEWHERE and not name.endswith(".tmp"):
                file = Path(at, name)
                digests[file.relative_to(folder).as_posix()] = _digest(file)
    return digests


def _digest(file: Path) -> str:
    return hashlib.md5(file.read_bytes()).hexdigest()


def locked(folder: Path) -> dict[str, dict[str, str]]:
    """Digests of outputs and inputs in dvc.lock, by stage."""
    stages = YAML(typ="safe").load(folder / "dvc.lock")["stages"]
    return {
        name: {file["path"]: file["md5"] for kind in ("deps", "outs") for file in entry[kind]}
        for name, entry in stages.items()
    }


def halves(folder: Path, *wholes: dict[str, str]) -> list[str]:
    """Files that a run makes which are there and are not as in one of `wholes`."""
    here = {name: digest for name, digest in contents(folder).items() if name.split("/")[0] in MADE}
    return sorted(
        name for name, digest in here.items() if digest not in {whole.get(name) for whole in wholes}
    )


def temporaries(folder: Path) -> list[str]:
    """What a killed writer may leave beside its file; Prefect's and DVC's own folders apart."""
    files = (file for file in folder.rglob("*.tmp") if ".prefect" not in file.parts)
    return sorted(str(file.relative_to(folder)) for file in files)


def broken(folder: Path) -> list[str]:
    """Files of DVC's cache, or of a remote, that are not what their name says."""
    files = []
    for file in folder.glob("files/md5/*/*"):
        if file.is_file() and file.parent.name + file.name.removesuffix(".dir") != _digest(file):
            files.append(str(file.relative_to(folder)))
    return files


def held(folder: Path) -> list[str]:
    """Locks of DVC's and the flow's that somebody holds, or that no DVC can read.

    What a process that has ended held DVC forgets by itself.
    """
    locks = []
    for name in LOCKS:
        path = folder / name
        if not path.is_file():
            continue
        with path.open("r+") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                locks.append(name)
    rwlock = folder / ".dvc/tmp/rwlock"
    if rwlock.is_file():
        try:
            content = json.loads(rwlock.read_text(encoding="utf-8"))
            holders = [*content.get("write", {}).values()]
            holders += [holder for some in content.get("read", {}).values() for holder in some]
            lives = any(psutil.pid_exists(holder["pid"]) for holder in holders)
        except (ValueError, AttributeError, TypeError, KeyError):
            lives = True
        locks += [".dvc/tmp/rwlock"] if lives else []
    return locks
