"""What our writer of dvc.lock writes is what DVC would, to the byte."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.flow import whole
from tests.app.flow.toy import Toy, stage

LONG = "a_name_that_makes_the_command_longer_than_a_line_of_yaml_may_become"
STAGES = {
    "first": stage("first", "word", params=["small", "list", "text"]),
    LONG: stage(LONG, "first.out", "word"),
    "1e5": {"cmd": "echo 1 > '1e5.out'\necho 2", "deps": ["first.out"], "outs": ["1e5.out"]},
    "last": stage("last", f"{LONG}.out"),
}
PARAMS = "small: 1.0e-06\nlist: [1, 2.50, yes, null]\ntext: 'on: # off'\n"


def test_the_lock_is_dvcs_own_to_the_byte(tmp_path: Path) -> None:
    toy = Toy(tmp_path / "theirs", STAGES, word="one\n")
    (toy.folder / "params.yaml").write_text(PARAMS)
    ours = toy.copy(tmp_path / "ours")
    for word in ("one\n", "two\n"):  # entries are added, then exchanged
        locks = []
        for one, command in ((toy, ["-m", "dvc"]), (ours, ["-P", whole.__file__])):
            (one.folder / "word").write_text(word)
            done = one(*command, "repro")
            assert done.returncode == 0, done.stderr
            locks.append((one.folder / "dvc.lock").read_text())
        assert locks[0] == locks[1]
        assert "1e-06" in locks[0] and "1e5" in locks[0]


def test_a_file_that_is_cut_off_stays_as_it_was(tmp_path: Path) -> None:
    from dvc.fs import localfs

    ours, path = whole.Renaming(localfs), str(tmp_path / "rwlock")
    with ours.open(path, "w", encoding="utf-8") as file:
        file.write("whole")
    with pytest.raises(KeyboardInterrupt), ours.open(path, "w", encoding="utf-8") as file:
        file.write("ha")
        raise KeyboardInterrupt
    with ours.open(path, encoding="utf-8") as file:
        assert file.read() == "whole"
    assert [one.name for one in tmp_path.iterdir()] == ["rwlock"]


def test_a_file_that_is_not_of_stages_alone_is_left_to_dvc() -> None:
    entry = {"cmd": "echo"}
    assert whole.put(whole.HEAD, "one", entry) == f"{whole.HEAD}  one:\n    cmd: echo\n"
    assert whole.put(f"{whole.HEAD}  a:\n    cmd: b\ndatasets: []\n", "one", entry) is None
    assert whole.put("", "one", entry) is None
