"""What killed DVC commands leave: locks, half of dvc.lock; see test_killed.py too."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from dvc.lock import Lock, make_lock

from app.flow import child
from app.flow.graph import Graph
from pipeline.base.errors import UserError
from stages import dvc_files
from tests.app.flow.toy import Toy, stage


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Toy:
    stages = {name: stage(name, "word") for name in ("one", "two")}
    toy = Toy(tmp_path / "toy", stages, word="one\n")
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", toy.environment["DVC_SITE_CACHE_DIR"])
    (toy.folder / ".dvc/tmp").mkdir()
    return toy


def test_hardlink_locks_as_in_a_shared_folder(toy: Toy, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of the other kind of lock is in nobody's way; one that is held is never broken."""
    tmp = toy.folder / ".dvc/tmp"
    with (toy.folder / ".dvc/config").open("a") as config:
        config.write(" hardlink_lock = true\n")
    for name in ("lock", "rwlock.lock"):
        with Lock(str(tmp / name)):
            pass
    dvc_files.mend(toy.folder)
    assert [*Graph(toy.folder).stages] == ["one", "two"]
    assert not (tmp / "lock").exists()
    monkeypatch.setattr("dvc.lock.DEFAULT_TIMEOUT", 0.1)
    with make_lock(str(tmp / "lock"), tmp_dir=str(tmp), hardlink_lock=True):
        dvc_files.mend(toy.folder)
        with pytest.raises(UserError, match="another DVC command is at work.* rm .dvc/tmp/lock"):
            Graph(toy.folder)


def test_who_is_in_a_stages_way_is_named_in_one_line(toy: Toy) -> None:
    held = {str(toy.folder / "one.out"): {"pid": os.getpid(), "cmd": "dvc status"}}
    (toy.folder / ".dvc/tmp/rwlock").write_text(json.dumps({"write": held, "read": {}}))
    with pytest.raises(child.StageFailed) as failure:
        child.run_stage(toy.folder, "one", environment=toy.environment, on_line=lambda line: None)
    assert str(failure.value).endswith(f"is being blocked by: (PID {os.getpid()}): dvc status")


def test_paths_of_the_dead_are_released_and_those_of_the_living_kept(toy: Toy) -> None:
    path = toy.folder / ".dvc/tmp/rwlock"
    dvc_files.mend(toy.folder)
    assert not path.exists()
    code = "import time; time.sleep(60)"
    living = subprocess.Popen([sys.executable, "-c", code, "repro", "-s", "count@a"])
    try:
        alive = {"pid": living.pid, "cmd": "dvc repro -s count@a"}
        other = {"pid": os.getpid(), "cmd": "dvc repro -s count@b"}  # a number that lives again
        held = {"write": {"/a": alive, "/b": other}, "read": {"/c": [alive, other], "/d": [other]}}
        path.write_text(json.dumps(held))
        dvc_files.mend(toy.folder)
        assert json.loads(path.read_text()) == {"write": {"/a": alive}, "read": {"/c": [alive]}}
    finally:
        living.kill()
        living.wait()
    for damaged in ("", '{"write": {', "[]", '{"write": {"/a": 1}}'):
        path.write_text(damaged)
        dvc_files.mend(toy.folder)
        assert not path.exists()


def test_a_dvc_lock_that_is_cut_off_anywhere_costs_its_last_entry(toy: Toy) -> None:
    """And no work: DVC has what that stage made in its cache of runs."""
    assert toy.dvc("repro") == {"one", "two"}
    path = toy.folder / "dvc.lock"
    whole = path.read_text()
    second = whole.index("  two:\n")
    for end in range(0, len(whole), 7):
        path.write_text(whole[:end])
        dvc_files.mend(toy.folder)
        if path.is_file():
            left = path.read_text()
            assert left in (whole[:end], whole[:second])
            assert dvc_files._is_valid(left)
            assert end < second or left.startswith(whole[:second])
        else:
            assert end < second
    path.write_text(whole[: second + 30])
    dvc_files.mend(toy.folder)
    assert toy.dvc("repro") == set()
    assert path.read_text() == whole
    conflict = whole.replace("  one:\n", "<<<<<<< HEAD\n  one:\n")  # not ours to mend
    path.write_text(conflict)
    dvc_files.mend(toy.folder)
    assert path.read_text() == conflict
    with pytest.raises(UserError, match="^DVC: [^\n]*dvc.lock[^\n]*$"):
        Graph(toy.folder)


def test_a_fit_mends_a_dvc_lock_that_is_cut_off(toy: Toy) -> None:
    """`sling fit` and `sling observe` have DVC run without a flow around it."""
    assert toy.dvc("repro") == {"one", "two"}
    path = toy.folder / "dvc.lock"
    whole = path.read_text()
    path.write_text(whole[: whole.rindex("deps:") + 4])
    child.repro(toy.folder, "two", print)
    assert path.read_text() == whole
