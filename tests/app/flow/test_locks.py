"""Locks of DVC's two kinds, as killed commands leave them; more in test_killed.py."""

from __future__ import annotations

import json
import os
import socket
import subprocess
from pathlib import Path

import pytest
from dvc.lock import Lock, LockError, make_lock

from app.flow import child, locks, whole
from app.flow.graph import Graph
from tests.app.flow.toy import Toy, stage


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Toy:
    """A project whose locks are to be hardlinks, as in a shared folder."""
    toy = Toy(tmp_path / "toy", {"one": stage("one", "word")}, word="one\n")
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", toy.environment["DVC_SITE_CACHE_DIR"])
    with (toy.folder / ".dvc/config").open("a") as config:
        config.write(" hardlink_lock = true\n")
    (toy.folder / ".dvc/tmp").mkdir()
    return toy


def dead() -> int:
    """The number of a process that has ended."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def held(path: Path, host: str, pid: int) -> Path:
    """A hardlink lock that this process left; its claim."""
    claim = path.with_name(f"{path.name}|{host}|{pid}|1")
    claim.write_text(str(claim))
    path.hardlink_to(claim)
    return claim


def test_a_file_of_the_other_kind_of_lock_is_in_nobodys_way(toy: Toy) -> None:
    for name in ("lock", "rwlock.lock"):
        with Lock(str(toy.folder / ".dvc/tmp" / name)):
            pass
        assert (toy.folder / ".dvc/tmp" / name).exists()
    locks.mend(toy.folder)
    assert [*Graph(toy.folder).stages] == ["one"]
    assert not (toy.folder / ".dvc/tmp/lock").exists()  # of the kind that is configured


def test_what_the_dead_of_this_machine_hold_is_free(toy: Toy) -> None:
    path = toy.folder / ".dvc/tmp/lock"
    claim = held(path, socket.gethostname(), dead())
    locks.mend(toy.folder)
    assert [*Graph(toy.folder).stages] == ["one"]
    assert not claim.exists()


def test_who_is_in_a_stages_way_is_named_in_one_line(toy: Toy) -> None:
    held = {str(toy.folder / "one.out"): {"pid": os.getpid(), "cmd": "dvc status"}}
    (toy.folder / ".dvc/tmp/rwlock").write_text(json.dumps({"write": held, "read": {}}))
    with pytest.raises(child.StageFailed) as failure:
        child.run_stage(toy.folder, "one", environment=toy.environment, on_line=lambda line: None)
    assert str(failure.value).endswith(f"is being blocked by: (PID {os.getpid()}): dvc status")


def test_what_the_living_and_others_hold_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "lock"
    whole.sign_locks()
    with make_lock(str(path), tmp_dir=str(tmp_path), hardlink_lock=True):
        assert f"|{socket.gethostname()}|{os.getpid()}|" in path.read_text()
        locks._free(path)
        assert path.exists()
    assert not path.exists()
    claim = held(path, "another", dead())
    locks._free(path)
    assert path.exists()
    path.unlink()
    claim.unlink()
    monkeypatch.setattr("dvc.lock.DEFAULT_TIMEOUT", 0)
    with Lock(str(path)):
        with pytest.raises(LockError):
            locks._free(path)
        assert path.exists()
