"""Flows of a small project as a user starts them."""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

from app.flow import guard, run
from app.flow.log import FOLDER
from pipeline.base.errors import UserError
from tests.app.flow.toy import Toy, stage
from tests.project import python
from validation.projects import CLI

GPU = {"gpu": True}
STAGES = {
    "top": stage("top", "word"),
    "side": {
        "matrix": {"item": ["left", "right"]},
        **stage("side-${item.item}", "top.out", seconds=0.5, meta=GPU),
    },
    "free-a": stage("free-a", "other", seconds="@free-b"),
    "free-b": stage("free-b", "other", seconds="@free-a"),
    "bottom": stage("bottom", "side-left.out", "side-right.out"),
}
NAMES = {"top", "side@left", "side@right", "free-a", "free-b", "bottom"}


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Toy:
    toy = Toy(tmp_path_factory.mktemp("run") / "toy", STAGES, word="one\n", other="one\n")
    return toy


def sling(toy: Toy, *arguments: str, **exported: str) -> subprocess.CompletedProcess:
    """`sling flow`."""
    return python(*CLI, "flow", *arguments, folder=toy.folder, **{**toy.environment, **exported})


def last(toy: Toy) -> list[dict]:
    """The log of the last run."""
    path = max((toy.folder / FOLDER).iterdir(), key=lambda file: file.stat().st_mtime_ns)
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def overlap(toy: Toy, *names: str) -> bool:
    notes = [toy.note(name) for name in names]
    return max(note["begin"] for note in notes) < min(note["end"] for note in notes)


@pytest.mark.slow
def test_a_whole_flow(toy: Toy) -> None:
    done = sling(toy, "--workers", "3", "--gpus", "1", SLING_DEVICE="cpu", COLOUR="blue")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(
        r"stages: 6 ran, 0 fresh after all, 0 failed, 0 not run \(.* s\)\n", done.stdout
    )
    lines = done.stderr.splitlines()
    assert "side@left | side-left works" in lines
    assert all(line.split(" | ")[0] in NAMES for line in lines[2:]), done.stderr

    assert overlap(toy, "free-a", "free-b")
    assert not overlap(toy, "side-left", "side-right")  # one GPU
    assert toy.note("top")["end"] < toy.note("side-left")["begin"]
    assert toy.note("side-right")["end"] < toy.note("bottom")["begin"]
    environment = toy.note("bottom")["environment"]
    share = str(max(1, len(os.sched_getaffinity(0)) // 3))
    assert environment["SLING_WORKERS"] == environment["OMP_NUM_THREADS"] == share
    assert (environment["SLING_DEVICE"], environment["COLOUR"]) == ("cpu", "blue")

    assert toy.dvc("repro") == set()
    assert not (toy.folder / ".gitignore").exists()


@pytest.mark.slow
def test_a_flow_needs_no_prefect(toy: Toy) -> None:
    (toy.folder / "other").write_text("one\nmore\n")
    script = (
        "import sys; from pathlib import Path; from app.flow.run import run\n"
        "print(run(Path.cwd())); assert 'prefect' not in sys.modules"
    )
    assert "stages: 2 ran" in toy("python", "-c", script)
    message = toy("python", "-c", script)
    assert re.fullmatch(r"all 6 stages are fresh \(.* s\)\n", message)
    assert not (toy.folder / ".prefect").exists()


@pytest.mark.slow
def test_a_failure_stops_only_what_follows_from_it(toy: Toy) -> None:
    toy.ran()
    (toy.folder / "word").write_text("bad\n")
    (toy.folder / "other").write_text("two\n")
    done = sling(toy)
    assert done.returncode == 1
    assert toy.ran() == {"free-a", "free-b"}
    assert done.stdout == ""
    assert done.stderr.splitlines()[-2].startswith("stages: 2 ran, 0 fresh after all, 1 failed, 3")
    assert done.stderr.splitlines()[-1] == "error: top: word: says bad; write something else"
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_the_next_flow_goes_on_and_an_unchanged_output_ends_it(toy: Toy) -> None:
    """After the failure above, with the word that was there before it."""
    toy.ran()
    (toy.folder / "word").write_text("one\nmore\n")
    done = sling(toy)
    assert done.stdout.startswith("stages: 1 ran, 3 fresh after all, 0 failed, 0 not run (")
    assert toy.ran() == {"top"}
    assert toy.dvc("repro") == set()
    states = {event.get("stage"): event["state"] for event in last(toy) if event["what"] == "ended"}
    assert states == {
        "top": "ran", "side@left": "fresh", "side@right": "fresh", "bottom": "fresh", None: "ran",
    }  # fmt: skip


def test_two_flows_in_one_folder_are_refused(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(guard, "GRACE", -4.0)
    toy = Toy(tmp_path / "toy", {"one": stage("one", "word")}, word="one\n")
    with run.alone(toy.folder):
        with pytest.raises(UserError, match="another `sling flow` is at work"):
            with run.alone(toy.folder):
                pass
    with run.alone(toy.folder):
        pass


def test_the_lock_lasts_as_long_as_a_guard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A flow that was killed leaves it to those who end its stages."""
    monkeypatch.setattr(guard, "GRACE", 0.0)
    toy = Toy(tmp_path / "toy", {"one": stage("one", "word")}, word="one\n")
    with run.alone(toy.folder):
        heir = subprocess.Popen(["sleep", "1.5"], close_fds=False)
    with run.alone(toy.folder):
        assert heir.wait(0.5) == 0


def test_elsewhere_it_says_so(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no dvc.yaml"):
        run.run(tmp_path)


def test_devices_are_shared_out_among_gpu_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    assert run.gpu_shares({}, None) is None
    assert run.gpu_shares({"SLING_DEVICE": "cpu"}, None) is None
    assert run.gpu_shares({"SLING_DEVICE": "cuda:0"}, None) == [{}]
    assert run.gpu_shares({}, 2) == [{}, {}]
    three = ("cuda:0", "cuda:1", "cuda:2")
    monkeypatch.setattr("pipeline.base.machine.devices", lambda: three)
    assert run.gpu_shares({"SLING_DEVICE": "cuda"}, 2) == [
        {"SLING_DEVICE": "cuda:0,cuda:2"},
        {"SLING_DEVICE": "cuda:1"},
    ]
    assert [share["SLING_DEVICE"] for share in run.gpu_shares({"SLING_DEVICE": "cuda"}, 4)] == [
        *three,
        "cuda:0",
    ]
