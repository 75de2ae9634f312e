"""What Prefect's database has of runs, read from their logs; by a server: test_run.py."""

import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from app.flow import log, server
from tests.project import ROOT

pytestmark = pytest.mark.slow
# Follows the logs of a folder that it is given, a look for each "on"; what a stage has to show is
# its name.
FOLLOWER = """
import asyncio, sys
from pathlib import Path
from app.flow import follow
follow.EVERY = 0
follow.artifact = lambda stage, root: f"| {stage} |" if "theta" in stage else ""

def goes_on():
    print("looked", flush=True)
    return sys.stdin.readline().strip() == "on"

for line in sys.stdin:
    asyncio.run(follow.follow(Path(line.strip()), goes_on))
    print("ended", flush=True)
"""
THETA, REPORT, BAR = "theta@b-m", "report", "history-b-m {}/4 rollouts  generation {}  best 0.5"
LOCK = f"schema: '2.0'\nstages:\n  {THETA}:\n    cmd: x\n"


class Shown:
    """A follower of logs, and the database that it writes."""

    def __init__(self, root: Path) -> None:
        self.database = server.home(root) / "prefect.db"
        self.process = subprocess.Popen(
            [sys.executable, "-c", FOLLOWER],
            env=server.clean(root) | {"PYTHONPATH": str(ROOT)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def say(self, line: str) -> None:
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() in ("looked\n", "ended\n")

    def look(self, root: Path, looks: int = 1) -> None:
        """As a UI that is opened, and closed again."""
        for line in (str(root), *["on"] * looks, "end"):
            self.say(line)

    def __call__(self, what: str, run: str) -> list[tuple]:
        """Rows of one run."""
        with closing(sqlite3.connect(self.database)) as database:
            return database.execute(QUERIES[what], (run,)).fetchall()

    def all(self, run: str) -> dict[str, list[tuple]]:
        return {what: self(what, run) for what in QUERIES}


OF_RUN = "replace(flow_run_id, '-', '') = ?"
OF_TASKS = f"task_run_id in (select id from task_run where {OF_RUN})"
QUERIES = {
    "runs": "select name, tags, state_name, start_time, end_time, total_run_time from flow_run"
    " where replace(id, '-', '') = ?",
    "tasks": "select name, tags, state_name, start_time, end_time, json_array_length("
    f"json_extract(task_inputs, '$.wait_for')) from task_run where {OF_RUN} order by name",
    "states": f"select name, timestamp, message from flow_run_state where {OF_RUN} order by 2",
    "task states": f"select name, timestamp, message from task_run_state where {OF_TASKS}"
    " order by 2",
    "lines": f"select message, level, timestamp from log where {OF_RUN} order by 3",
    "artifacts": f"select key, type, data, description from artifact where {OF_RUN} order by 1",
}


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory, history: Path) -> Iterator[Shown]:
    root = tmp_path_factory.mktemp("shown")
    shutil.copytree(history, root / ".prefect")
    shown = Shown(root)
    yield shown
    shown.process.kill()
    shown.process.communicate()


def identity(run: log.RunLog) -> str:
    return run._begins["id"]


def copied(root: Path, folder: Path, upto: int | None = None) -> None:
    """The log of `root` in another folder, and its lines up to one."""
    for path in (root / log.FOLDER).iterdir():
        there = folder / log.FOLDER / path.name
        there.parent.mkdir(parents=True, exist_ok=True)
        there.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:upto]))


def test_a_run_is_shown_once_with_its_times(shown: Shown, tmp_path: Path) -> None:
    (tmp_path / "dvc.lock").write_text(LOCK)
    with log.RunLog(tmp_path, "sling flow", [THETA, REPORT]) as run:
        run.begins(THETA)
        for done in (1, 2, 4):
            run.line(THETA, BAR.format(done, done))
        run.ended(THETA, "ran")
        run.begins(REPORT, (THETA,))
        run.line(REPORT, "error: it is")
        run.ended(REPORT, "fresh")
    shown.look(tmp_path)
    rows = shown.all(identity(run))
    ((name, tags, state, begin, end, _),) = rows["runs"]
    assert (name, tags, state) == ("b: m", '["b", "m"]', "Completed")
    tasks = {row[0]: row[1:] for row in rows["tasks"]}
    assert {task: row[1] for task, row in tasks.items()} == {THETA: "Completed", REPORT: "Fresh"}
    assert tasks[THETA][0] == '["b", "m"]' and (tasks[THETA][4], tasks[REPORT][4]) == (0, 1)
    assert begin <= tasks[THETA][2] <= tasks[THETA][3] <= tasks[REPORT][2] <= end
    assert [line[:2] for line in rows["lines"]] == [
        *((BAR.format(done, done), 20) for done in (1, 2, 4)),
        ("error: it is", 40),
    ]
    bar, table = rows["artifacts"]
    assert bar[:2] == ("history-b-m", "progress") and float(bar[2]) == 100.0
    assert bar[3] == "██████████ · 4/4 rollouts · generation 4 · best 0.5"
    assert table == ("theta-b-m", "markdown", f'"| {THETA} |"', THETA)
    shown.look(tmp_path, looks=3)
    assert shown.all(identity(run)) == rows


def test_a_run_that_was_killed_crashed(shown: Shown, tmp_path: Path) -> None:
    with log.RunLog(tmp_path / "whole", "sling fit", [THETA]) as run:
        run.begins(REPORT)
        run.ended(REPORT, "ran")
        run.begins(THETA)
        run.line(THETA, "a line")
    copied(tmp_path / "whole", tmp_path, upto=-1)
    (path,) = (tmp_path / log.FOLDER).iterdir()
    path.write_bytes(path.read_bytes() + b'{"at": 1, "wh')  # it was writing when it was killed
    for _ in range(2):
        shown.look(tmp_path, looks=2)
        rows = shown.all(identity(run))
        assert rows["runs"][0][2] == "Crashed"
        assert [row[2] for row in rows["tasks"]] == ["Completed", "Crashed"]
        assert len(rows["states"]) == 2 and len(rows["task states"]) == 4
        assert rows["artifacts"] == []  # a killed run's stages: who knows


def test_a_run_is_followed_and_ends_as_if_it_were_read_at_once(shown: Shown, tmp_path) -> None:
    """By a UI that is opened twice, while it goes on."""
    (tmp_path / "dvc.lock").write_text(LOCK)
    with log.RunLog(tmp_path, "sling flow", [THETA]) as run:
        run.begins(THETA)
        run.line(THETA, BAR.format(1, 1))
        shown.say(str(tmp_path))
        shown.say("on")
        assert shown("runs", identity(run))[0][2] == "Running"
        assert shown("artifacts", identity(run))[0][3].startswith("██░░░░░░░░ · 1/4")
        run.line(THETA, BAR.format(3, 3))
        shown.say("on")
        assert shown("artifacts", identity(run))[0][3].startswith("███████░░░ · 3/4")
        shown.say("end")
        run.line(THETA, "said while nobody looks")
        run.ended(THETA, "ran")
        shown.look(tmp_path)
        assert [row[0] for row in shown("artifacts", identity(run))] == ["history-b-m", "theta-b-m"]
        run.begins(REPORT, (THETA,))
    shown.look(tmp_path)
    rows = shown.all(identity(run))
    assert len(rows["lines"]) == 3 and len(rows["task states"]) == 4
    assert rows["runs"][0][2] == "Completed"
    other = "f" * 32
    copied(tmp_path, tmp_path / "other")
    (path,) = (tmp_path / "other" / log.FOLDER).iterdir()
    path.write_text(path.read_text("utf-8").replace(identity(run), other), "utf-8")
    (tmp_path / "other" / "dvc.lock").write_text(LOCK)
    shown.look(tmp_path / "other")
    assert shown.all(other) == rows


def test_what_a_later_run_made_is_not_shown_as_an_earlier_ones(shown: Shown, tmp_path) -> None:
    (tmp_path / "dvc.lock").write_text(LOCK)
    with log.RunLog(tmp_path, "sling flow", [THETA]) as run:
        run.begins(THETA)
        run.ended(THETA, "ran")
    (tmp_path / "dvc.lock").write_text(LOCK.replace("cmd: x", "cmd: y"))
    shown.look(tmp_path)
    assert shown("tasks", identity(run)) and shown("artifacts", identity(run)) == []


def test_a_log_that_is_none_keeps_no_other_from_being_shown(shown: Shown, tmp_path) -> None:
    folder = tmp_path / log.FOLDER
    folder.mkdir(parents=True)
    (folder / "0.jsonl").write_text("no JSON\n")
    (folder / "1.jsonl").write_text("")
    with log.RunLog(tmp_path, "sling flow", [THETA]) as run:
        run.begins(THETA)
    shown.look(tmp_path)
    assert shown("runs", identity(run))
