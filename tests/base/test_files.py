"""Whole files or none, and nothing left of processes that were killed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.base.files import replacing, replacing_folder, write_text


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    write_text(file, "old")
    with pytest.raises(RuntimeError), replacing(file) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert [one.name for one in tmp_path.iterdir()] == ["a.txt"] and file.read_text() == "old"


def test_a_folder_is_replaced_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "a"
    for names in (("1", "2"), ("1",)):
        with replacing_folder(folder) as temporary:
            for name in names:
                (temporary / name).write_text(name)
        assert sorted(one.name for one in folder.iterdir()) == list(names)
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    (tmp_path / f".a.{dead.pid}.tmp").mkdir()
    with pytest.raises(RuntimeError), replacing_folder(folder) as temporary:
        (temporary / "3").write_text("half")
        raise RuntimeError
    assert [one.name for one in folder.iterdir()] == ["1"]
    assert [one.name for one in tmp_path.iterdir()] == ["a"]


def test_a_file_is_on_the_disk_before_it_bears_its_name(tmp_path, monkeypatch) -> None:
    file, synced = tmp_path / "a.txt", []

    def sync(number: int) -> None:
        synced.append((os.fstat(number).st_ino, os.fstat(number).st_size, file.exists()))

    monkeypatch.setattr(os, "fsync", sync)
    write_text(file, "new")
    assert synced == [(file.stat().st_ino, 3, False)]


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
    left = {one.name for one in tmp_path.iterdir()}
    assert left == {"a[1].txt", names["alive"], names["other"], names["longer"]}
