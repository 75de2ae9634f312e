"""What a stage needs, how copies differ, transfers, and how entries come into dvc.lock."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from app.cluster import exchange
from app.flow import child
from app.flow.graph import stages_of
from pipeline.base.errors import UserError
from tests.app.cluster.several import Copy, toy
from tests.project import alive

# Python reads it at its start: notes its number and waits, as a transfer of many files does.
WAITS = """\
import os, pathlib, sys, time
if "push" in sys.argv and "repro" not in sys.argv and not sys.flags.isolated:
    pathlib.Path("pid").write_text(str(os.getpid()))
    time.sleep(600)
"""


@pytest.fixture
def head(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Copy:
    head = toy(tmp_path / "head")
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", head.environment["DVC_SITE_CACHE_DIR"])
    return head


@pytest.fixture
def copies(head: Copy) -> tuple[Copy, Copy]:
    """The head and a worker's copy."""
    return head, head.clone("worker")


def test_what_differs_in_a_copy_is_named(copies, tmp_path: Path) -> None:
    head, other = copies
    sources = stages_of(head.folder)["search@a"].sources
    assert sources == ("recordings", "step.py")
    # pipeline/params, start.py: untracked by DVC, and yet the code of every stage
    assert {"dvc.yaml", "params.yaml", "pipeline/params", "stages/start.py"} < {*exchange.ALWAYS}
    digests = exchange.digests(head.folder, (*exchange.ALWAYS, *sources))
    for number, (changes, says) in enumerate(
        (
            ({}, None),
            ({"params.yaml": "seed: 3\n"}, "params.yaml differs"),
            ({"recordings/b": "more\n"}, "recordings differs"),
            ({"pipeline/params/lab.py": "more\n"}, "pipeline/params differs"),
            ({"recordings/__pycache__/b.pyc": "more\n", "data/search/a": "old"}, None),
            ({"dvc.yaml": None}, "dvc.yaml is missing"),
            ({"dvc.yaml": None, "step.py": "pass\n"}, "dvc.yaml and 1 more differ"),
        )
    ):
        copy = shutil.copytree(other.folder, tmp_path / str(number))
        for name, content in changes.items():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            (copy / name).unlink() if content is None else (copy / name).write_text(content)
        answer = exchange.differing(copy, digests)
        assert answer is None if says is None else answer.startswith(says)


def test_producers_follow_folders(head: Copy) -> None:
    """The report reads the folder in which others write."""
    needs = stages_of(head.folder)
    assert needs["report"].producers == ("search@a", "train")
    assert needs["train"].producers == ("search@b",)
    assert {name for name, need in needs.items() if need.gpu} == {"train"}
    assert {name for name, need in needs.items() if not need.travels} == {"report"}


def test_entries_merged_at_once_are_all_there(head: Copy) -> None:
    """By threads of this process and beside DVC's own writes: dvc.lock keeps them all."""
    names = [f"search@{number}" for number in range(8)]
    entry = {"cmd": "yes", "outs": [{"path": "on", "md5": "0" * 32, "size": 1}]}
    with ThreadPoolExecutor(4) as pool:
        repro = pool.submit(head, "dvc", "--wait-for-lock", "repro", "-q", "search@a")
        list(pool.map(lambda name: exchange.merge(head.folder, {name: entry}), names))
        repro.result(timeout=60)
    stages = YAML(typ="safe").load(head.folder / "dvc.lock")["stages"]
    assert stages.keys() == {*names, "search@a"}
    assert all(stages[name] == entry for name in names)


def test_a_merged_lock_reads_as_one_of_dvcs(head: Copy) -> None:
    """The same bytes, so that Git shows the stages that changed and no others."""
    head("dvc", "repro", "-q", "train", "search@a")
    lock = head.folder / "dvc.lock"
    before = lock.read_text()
    entry = exchange.entries(head.folder, ("train",))["train"]
    exchange.merge(head.folder, {"train": {**entry, "cmd": "another"}})
    assert lock.read_text() != before
    exchange.merge(head.folder, {"train": entry})
    assert lock.read_text() == before


# Transfers run behind a guard, as stages do: they hear an interrupt, and say one line.


def test_a_cancelled_transfer_leaves_nothing(head, tmp_path, monkeypatch) -> None:
    (tmp_path / "sitecustomize.py").write_text(WAITS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    pid = head.folder / "pid"
    with pytest.raises(child.Cancelled):
        exchange.transfer(
            head.folder, "push", ("search@a",), lambda: pid.exists() and bool(pid.read_text())
        )
    assert not alive(int(pid.read_text()))


def test_a_cancelled_transfer_does_not_begin(head: Copy) -> None:
    with pytest.raises(child.Cancelled):
        exchange.transfer(head.folder, "push", ("search@a",), lambda: True)
    assert not (head.folder / ".dvc/tmp").exists()


def test_a_transfer_that_fails_says_why_in_one_line(head: Copy) -> None:
    with pytest.raises(UserError, match="^[^\n]*: dvc push nothing: [^\n]*'nothing'[^\n]*$"):
        exchange.transfer(head.folder, "push", ("nothing",), lambda: False)


def test_a_transfer_that_fails_on_a_full_disk_names_it(head: Copy, monkeypatch) -> None:
    full = shutil.disk_usage(head.folder)._replace(free=10_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: full)
    with pytest.raises(UserError, match=f"^{head.folder}: .*No space left on device"):
        exchange.transfer(head.folder, "push", ("nothing",), lambda: False)
