"""What a stage needs, how copies differ, and how entries come into dvc.lock."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from app.cluster import exchange
from tests.app.cluster.several import Copy, toy


@pytest.fixture
def copies(tmp_path: Path) -> tuple[Copy, Copy]:
    """The head and a worker's copy."""
    head = toy(tmp_path / "head")
    return head, head.clone("worker")


def test_what_differs_in_a_copy_is_named(copies, tmp_path: Path) -> None:
    head, other = copies
    needs = exchange.needs(head.folder)["search@a"]
    untracked = {"pipeline/params", "stages/start.py"}  # by DVC, and yet the code of every stage
    always = {"dvc.yaml", "params.yaml", *untracked}
    assert set(needs.sources) == {*always, "step.py", "recordings"}
    digests = exchange.digests(head.folder, needs.sources)
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


def test_needs_follow_folders(copies) -> None:
    """The report reads the folder in which others write."""
    needs = exchange.needs(copies[0].folder)
    assert needs["report"].producers == ("search@a", "train")
    assert needs["train"].producers == ("search@b",)
    assert {name for name, one in needs.items() if one.gpu} == {"train"}
    assert {name for name, one in needs.items() if not one.travels} == {"report"}


def test_entries_merged_at_once_are_all_there(copies) -> None:
    """By threads of this process and beside DVC's own writes: dvc.lock keeps them all."""
    head = copies[0]
    names = [f"search@{number}" for number in range(8)]
    entry = {"cmd": "yes", "outs": [{"path": "on", "md5": "0" * 32, "size": 1}]}
    with ThreadPoolExecutor(4) as pool:
        own = pool.submit(head, "dvc", "--wait-for-lock", "repro", "-q", "search@a")
        list(pool.map(lambda name: exchange.merge(head.folder, {name: entry}), names))
        own.result(timeout=60)
    found = YAML(typ="safe").load(head.folder / "dvc.lock")["stages"]
    assert found.keys() == {*names, "search@a"}
    assert all(found[name] == entry for name in names)


def test_a_merged_lock_reads_as_one_of_dvcs(copies) -> None:
    """The same bytes, so that Git shows the stages that changed and no others."""
    head = copies[0]
    head("dvc", "repro", "-q", "train", "search@a")
    lock = head.folder / "dvc.lock"
    before = lock.read_text()
    entry = exchange.entries(head.folder, ("train",))["train"]
    exchange.merge(head.folder, {"train": {**entry, "cmd": "another"}})
    assert lock.read_text() != before
    exchange.merge(head.folder, {"train": entry})
    assert lock.read_text() == before
