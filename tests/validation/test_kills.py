"""What the campaign of kills compares, how it fills a disk, and what its lines come to."""

import fcntl
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from pipeline.base.errors import UserError
from tests.project import ROOT, until
from validation.campaigns.kills import __main__ as campaign
from validation.campaigns.kills import compare, full_disk, strike
from validation.campaigns.kills.__main__ import disturb, report, shares
from validation.campaigns.runner import ResultLines
from validation.projects import MarkedRun

CAME_OUT = ("files", "digests", "nothing_more", "cache_whole")
EXPECTED = {"sling flow": {"seconds": 1.0, "files": {}, "begun": {}, "locks": {}}}
SAME = dict.fromkeys(campaign.CHECKS, True) | {"left_in_tmp": []}


def test_half_files_and_what_is_left_are_seen(tmp_path: Path) -> None:
    for name in (
        "data/a/b.json",
        "reports/c.md",
        ".git/x",
        "data/run.js",
        ".dvc/tmp/y",
        "dvc.lock",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("whole")
    whole = compare.contents(tmp_path)
    assert sorted(whole) == ["data/a/b.json", "reports/c.md"]
    (tmp_path / "data/a/b.json").write_text("who")
    (tmp_path / "data/a/.b.json.17.tmp").write_text("who")
    (tmp_path / "reports/.d.17.tmp").mkdir()
    (tmp_path / "reports/.d.17.tmp/e.md").write_text("who")
    assert compare.halves(tmp_path, whole) == ["data/a/b.json"]
    assert compare.halves(tmp_path, whole, compare.contents(tmp_path)) == []
    assert compare.temporaries(tmp_path) == ["data/a/.b.json.17.tmp", "reports/.d.17.tmp"]
    (tmp_path / "data/a/b.json").unlink()
    (tmp_path / "data/new.json").write_text("")
    assert compare.halves(tmp_path, whole) == ["data/new.json"]


def test_a_file_of_the_cache_is_what_its_name_says(tmp_path: Path) -> None:
    name = hashlib.md5(b"whole").hexdigest()
    folder = tmp_path / "files/md5" / name[:2]
    folder.mkdir(parents=True)
    (folder / name[2:]).write_bytes(b"whole")
    (folder / f"{name[2:]}.dir").write_bytes(b"whole")
    assert compare.broken(tmp_path) == []
    (folder / name[2:]).write_bytes(b"who")
    assert compare.broken(tmp_path) == [f"files/md5/{name[:2]}/{name[2:]}"]


def test_locks_that_somebody_holds_are_seen(tmp_path: Path) -> None:
    folder = tmp_path / ".dvc/tmp"
    folder.mkdir(parents=True)
    (folder / "lock").touch()
    assert compare.held(tmp_path) == []
    with (folder / "lock").open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert compare.held(tmp_path) == [".dvc/tmp/lock"]
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    for pid, held in ((dead.pid, []), (os.getpid(), [".dvc/tmp/rwlock"])):
        for content in (
            {"write": {"/a": {"pid": pid, "cmd": ""}}, "read": {}},
            {"write": {}, "read": {"/a": [{"pid": pid, "cmd": ""}]}},
        ):
            (folder / "rwlock").write_text(json.dumps(content))
            assert compare.held(tmp_path) == held
    (folder / "rwlock").write_text('{"write": {')
    assert compare.held(tmp_path) == [".dvc/tmp/rwlock"]


class Sleeper:
    """Stands for a copy of the project: its command starts a stage that writes and waits."""

    name = "sling flow"
    CODE = """
import subprocess, sys
code = "import os, time; open('big', 'ab').write(b'1' * 10 ** 7) if {write} else 0; time.sleep({s})"
print(subprocess.run([sys.executable, "-c", code, "stages.floor"], stderr=subprocess.STDOUT))
"""

    def __init__(self, place: Path, seconds: float = 60, write: bool = False) -> None:
        self.place, self.disk, self.folder = place, place / "disk", place / "disk"
        self.folder.mkdir(exist_ok=True)
        self.code = self.CODE.format(s="{s}", write="{write}").replace("{s}", str(seconds))
        self.code = self.code.replace("{write}", str(write))
        self.run = MarkedRun(self.folder, place / "said.txt")

    def start(self) -> subprocess.Popen:
        return self.run.start(sys.executable, "-c", self.code)

    def left(self, seconds: float) -> list[str]:
        return self.run.left(seconds)


def test_a_command_is_struck_and_what_lives_on_is_a_fault(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(strike, "MEAN", 0.5)
    monkeypatch.setattr(strike, "PROMPT", 0.2)
    monkeypatch.setattr(strike, "VICTIMS", ("command",))
    result = strike.struck(Sleeper(tmp_path), 0, 3, 1)
    assert result["status"] == -signal.SIGKILL
    assert [k["hit"] for k in result["kills"]] == ["the command"]
    assert len(result["faults"]) == 1 and "lives 0.2 s later" in result["faults"][0]  # its stage
    assert not Sleeper(tmp_path).run.alive()


def test_a_process_or_a_group_is_hit(tmp_path: Path) -> None:
    for victim in ("process", "group"):
        copy = Sleeper(tmp_path)
        command = copy.start()
        until(lambda: len(copy.run.named("stages.floor")) == 2)  # noqa: B023 the command names it too
        rng = np.random.default_rng(1)
        assert strike.strike(copy.run, command, victim, rng) == "stage floor"
        command.wait(10)
        copy.left(0)
        assert command.returncode == (0 if victim == "process" else -signal.SIGKILL)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    try:
        with full_disk.small_disk(tmp_path / "disk"):
            yield tmp_path / "disk"
    except UserError as error:
        pytest.skip(str(error))


def test_a_small_disk_is_filled_to_the_bytes_that_are_to_stay_free(disk: Path) -> None:
    full_disk.fill(disk / "ballast", 50_000)
    assert 50_000 - 4096 <= shutil.disk_usage(disk).free <= 50_000 + 4096
    with pytest.raises(OSError, match="No space left"):
        (disk / "more").write_bytes(b"1" * 100_000)


def test_a_command_that_is_quiet_about_a_full_disk_is_a_fault(disk: Path, monkeypatch) -> None:
    monkeypatch.setattr(full_disk, "MEAN", 0.0)
    message = full_disk.filled(Sleeper(disk.parent, 0, write=True), 0, 1, True)
    assert (
        message["status"] == 0 and message["full_after_s"] is not None
    )  # its child's failure is lost
    quiet = Sleeper(disk.parent)
    quiet.code = "raise SystemExit(1)"
    assert "status 1" in full_disk.filled(quiet, 0, 1, True)["faults"][0]
    quiet.code = "import sys, time; time.sleep(1); sys.exit('error: a: No space left on device')"
    result = full_disk.filled(quiet, 0, 1, True)
    assert result["faults"] == [] and result["said"] == "error: a: No space left on device"
    assert not (disk / "ballast").exists()


def test_disturbing_goes_on_where_it_was_and_ends_well(tmp_path: Path, monkeypatch) -> None:
    class Named:
        name, place = "sling flow", tmp_path
        folder = tmp_path / "copy"
        copies, begun = (folder,), 0

        def begin(self) -> None:
            self.begun += 1
            self.folder.mkdir(exist_ok=True)

        def mend(self) -> bool:
            return False

    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(campaign, "ended", lambda *_: dict.fromkeys(campaign.CHECKS, True))
    file, requested = tmp_path / "results.jsonl", []

    def attempt(number: int, most: int) -> dict:
        requested.append((number, most))
        if len(requested) == 3:
            raise KeyboardInterrupt
        kills = [{"hit": "flow", "sent_to": "process", "after_s": 1.0}] * min(most, 2)
        return {"status": 9 if kills else 0, "kills": kills, "seconds": 1.0, "faults": []}

    copy = Named()
    with pytest.raises(KeyboardInterrupt):
        disturb(copy, "kill", 5, ResultLines(file), EXPECTED["sling flow"], attempt)
    with file.open("a") as cut:
        cut.write('{"what": "att')
    disturb(copy, "kill", 5, ResultLines(file), EXPECTED["sling flow"], attempt)
    assert requested == [(0, 5), (1, 3), (2, 1), (2, 1), (3, 0)] and copy.begun == 1
    lines = ResultLines(file)
    disturb(copy, "kill", 5, lines, EXPECTED["sling flow"], attempt)  # all is done
    assert (
        len(requested) == 5
        and lines.where(what="round", name="sling flow", by="kill")[-1]["after"] == 5
    )
    names = ["sling flow"]
    assert report(lines, 5, 0, EXPECTED, names)["met"]
    assert not report(lines, 6, 0, EXPECTED, names)["met"]
    assert not report(lines, 5, 1, EXPECTED, names)["met"]
    for check in campaign.CHECKS:
        other = ResultLines(file)
        other.lines[-1] = other.lines[-1] | {check: False}
        assert not report(other, 5, 0, EXPECTED, names)["met"], check
    lines.lines[0]["faults"].append("lives on")
    summary = report(lines, 5, 0, EXPECTED, names)
    assert not summary["met"] and summary["figures"]["faults"][0]["fault"] == "lives on"
    assert summary["figures"]["hit"] == {"flow": 5}


def test_kills_are_shared_out_evenly() -> None:
    assert sum(shares(100, ["a", "b", "c"]).values()) == 100
    assert shares(20, ["a", "b", "c", "d"]) == dict.fromkeys("abcd", 5)


def test_the_docs_say_what_was_counted() -> None:
    summary = json.loads((ROOT / "reports/validation/kills.json").read_text(encoding="utf-8"))
    counts = summary["figures"]
    page = " ".join((ROOT / "docs/flow.md").read_text(encoding="utf-8").split())
    message = (
        f"{counts['kills']} kills at random moments over `dvc repro`, `sling flow`, `sling fit`"
    )
    assert message in page and f"and {counts['full_disks']} disks that became full" in page
    assert all(count[check] for count in counts["rounds"] for check in CAME_OUT)
    assert all("Prefect's server does not start" in count["fault"] for count in counts["faults"])
    left = [
        count for count in counts["rounds"] if not (count["no_temporaries"] and count["no_locks"])
    ]
    assert summary["met"] is not bool(left or counts["faults"])
    assert ("Two things were amiss there" in page) is not summary["met"]
