"""What one process of a test run makes and all of them use: xdist has several side by side."""

import fcntl
import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest

Made = TypeVar("Made")


def folder(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder of the run, which `make` fills where no process has done so yet; to be read only."""
    base = factory.getbasetemp()
    where = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "once" / name
    where.parent.mkdir(exist_ok=True)
    with Path(f"{where}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        made = Path(f"{where}.made")
        if not made.exists():
            shutil.rmtree(where, ignore_errors=True)  # left by one that failed
            where.mkdir()
            make(where)
            made.touch()
    return where


def value(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], Made]) -> Made:
    """What `make` returns, given a folder of the run for its files; each process gets a copy."""

    def keep(where: Path) -> None:
        (where / "value.pickle").write_bytes(pickle.dumps(make(where)))

    return pickle.loads((folder(factory, name, keep) / "value.pickle").read_bytes())
