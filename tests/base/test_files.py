"""Whole files or none, and nothing left of processes that were killed."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sling2sim2real.base.files import replacing, replacing_folder, write_text
from tests.project import python


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    write_text(file, "old")
    with pytest.raises(RuntimeError), replacing(file) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"] and file.read_text() == "old"


def test_a_folder_is_replaced_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "a"
    for names in (("1", "2"), ("1",)):
        with replacing_folder(folder) as temporary:
            for name in names:
                (temporary / name).write_text(name)
        assert sorted(path.name for path in folder.iterdir()) == list(names)
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    (tmp_path / f".a.{dead.pid}.tmp").mkdir()
    with pytest.raises(RuntimeError), replacing_folder(folder) as temporary:
        (temporary / "3").write_text("half")
        raise RuntimeError
    assert [path.name for path in folder.iterdir()] == ["1"]
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_file_is_on_the_disk_before_it_bears_its_name(tmp_path, monkeypatch) -> None:
    """What was synced, and whether the file or folder bore its name by then."""
    synced, sync = [], os.fsync
    target = tmp_path / "a"

    def noting(number: int) -> None:
        status = os.fstat(number)
        synced.append((status.st_ino, None if os.path.isdir(number) else status.st_size, present()))
        sync(number)

    monkeypatch.setattr(os, "fsync", noting)
    present = target.exists
    write_text(target, "new")
    folder = (tmp_path.stat().st_ino, None, True)
    assert synced == [(target.stat().st_ino, 3, False), folder]
    target.unlink()
    synced.clear()
    with replacing_folder(target) as temporary:
        (temporary / "b").mkdir()
        (temporary / "b" / "c").write_text("four")
    inside = [(target / "b").stat().st_ino, None, False], [(target / "b/c").stat().st_ino, 4, False]
    assert sorted(synced[:2]) == sorted(map(tuple, inside))
    assert synced[2:] == [(target.stat().st_ino, None, False), folder]


def test_a_folder_that_cannot_be_synced_is_none_the_worse(tmp_path, monkeypatch) -> None:
    """Some network file systems sync files alone."""
    sync = os.fsync

    def files_only(number: int) -> None:
        if os.path.isdir(number):
            raise OSError(errno.EINVAL, "Invalid argument")
        sync(number)

    monkeypatch.setattr(os, "fsync", files_only)
    write_text(tmp_path / "a.txt", "new")
    assert (tmp_path / "a.txt").read_text() == "new"


@pytest.mark.parametrize("place", ["replacing", "replacing_folder", "log"])
def test_a_full_disk_is_said_in_one_line(place: str, tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk."""
    code = f"""
import resource
from pathlib import Path
from sling2sim2real.base import errors
from sling2sim2real.base.files import replacing, replacing_folder
resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))
def log(path):
    path.write_bytes(bytes(501))
def main():
    if {place!r} == "log":
        return log(Path("a"))
    with {place}(Path("a")) as temporary:
        log(temporary / "b" if temporary.is_dir() else temporary)
errors.run(main)
"""
    done = python("-c", code, folder=tmp_path)
    what = "a file" if place == "log" else "a:"
    assert done.stderr == f"error: {what} cannot be written (File too large)\n"
    assert done.returncode == 1
    assert place == "log" or not list(tmp_path.iterdir())


def test_only_what_the_dead_left_is_removed(tmp_path: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    names = {
        "dead": f".a[1].txt.{dead.pid}.tmp",
        "alive": f".a[1].txt.{os.getppid()}.tmp",
        "other": f".b.txt.{dead.pid}.tmp",
        "longer": f".a[1].txt.more.{dead.pid}.tmp",
    }
    for name in names.values():
        (tmp_path / name).touch()
    write_text(tmp_path / "a[1].txt", "new")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"a[1].txt", names["alive"], names["other"], names["longer"]}
