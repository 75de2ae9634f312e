"""A stage as a child: its lines, why it failed, and that all its processes end."""

import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import pytest

from app.flow import child, guard
from app.flow.disk import with_disk
from tests.app.flow.toy import Toy, stage
from tests.project import until

SHELLS = {
    "nothing": "true",
    "sleeper": "python -c 'print(\"sleeps\", flush=True); import time; time.sleep(600)'",
}


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Toy:
    shells = {
        name: {"cmd": command, "deps": ["word"], "outs": [f"{name}.out"]}
        for name, command in SHELLS.items()
    }
    stages = {"good": stage("good", "word"), **shells}
    return Toy(tmp_path_factory.mktemp("child") / "toy", stages, word="one\n")


def run(toy: Toy, name: str, lines: list[str] | None = None, **more) -> bool:
    on_line = (lines if lines is not None else []).append
    return child.run_stage(toy.folder, name, environment=toy.environment, on_line=on_line, **more)


def alive(text: str) -> list[str]:
    """Command lines of living processes that hold `text`."""
    output = subprocess.run(["ps", "-eo", "stat,args"], capture_output=True, text=True).stdout
    return [line for line in output.splitlines() if text in line and not line.startswith("Z")]


def test_a_stage_runs_once_and_only_its_own_lines_are_received(toy: Toy) -> None:
    lines: list[str] = []
    assert run(toy, "good", lines)
    assert lines == ["good works"]
    assert (toy.folder / "good.out").read_text() == "one\n"
    assert not run(toy, "good", lines)
    assert lines == ["good works"]


def test_a_failure_says_why_in_one_line(toy: Toy) -> None:
    """Of its own: test_run.py."""
    with pytest.raises(child.StageFailed, match="^nothing: output 'nothing.out' does not exist$"):
        run(toy, "nothing")


def test_a_full_disk_is_named_where_dvc_speaks_of_something_else(toy: Toy, monkeypatch) -> None:
    """It said "No possible cache link types" of one; a reason that names it is left as it is."""
    full = shutil.disk_usage(toy.folder)._replace(free=10_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: full)
    why = f"{toy.folder}: cannot be written (No space left on device)"
    for act in (lambda: run(toy, "nothing"), lambda: child.repro(toy.folder, "nothing", print)):
        with pytest.raises(child.StageFailed) as failure:
            act()
        assert str(failure.value) == f"nothing: output 'nothing.out' does not exist; {why}"
    assert with_disk(why, toy.folder) == why


def failed(*lines: str, why: str) -> list[str]:
    """What DVC said of a stage that failed, around the stage's own lines."""
    return ["Running stage 'x':", "> x.py", *lines, f"ERROR: failed to reproduce 'x': {why}"]


RUN = "failed to run: x.py, exited with"
FAULT = ["1", "Traceback (most recent call last):", '  File "x"', "ZeroDivisionError: division"]
MISSING = "[Errno 2] No such file or directory: 'missing'"


def test_why_a_stage_failed_by_lines_of_dvc() -> None:
    for message, status, reason in (
        (failed("1", why=f"{RUN} -9"), 255, "was killed by signal 9"),
        (failed("Killed", why=f"{RUN} 137"), 255, "was killed by signal 9"),  # a shell around it
        (failed("Aborted", why=f"{RUN} 134"), 255, "was killed by signal 6"),
        (failed("error: it is", why=f"{RUN} 1"), 255, "it is"),
        (failed(why=f"{RUN} 3"), 255, "ended with exit status 3"),
        (failed(*FAULT, why=f"{RUN} 1"), 255, FAULT[-1]),
        ([f"ERROR: failed to reproduce 'x': {MISSING}"], 255, MISSING),  # before it ran
        (["Running stage 'x':", "> x.py", "1"], 128 + 9, "DVC was killed by signal 9"),
        (failed("1", why=f"{RUN} -2"), -9, "its guard was killed by signal 9"),
    ):
        assert child.reason("x", message, status) == reason


def test_lines_come_as_they_are_printed_and_a_cancelled_stage_leaves_nothing(toy: Toy) -> None:
    cancelled, lines = Event(), []
    with ThreadPoolExecutor(1) as pool:
        stage = pool.submit(run, toy, "sleeper", lines, cancelled=cancelled.is_set)
        until(lambda: lines == ["sleeps"])
        assert alive("time.sleep(600)")
        cancelled.set()
        with pytest.raises(child.Cancelled):
            stage.result(guard.GRACE + 5)
    assert not alive("time.sleep(600)")
    rwlock = (toy.folder / ".dvc" / "tmp" / "rwlock").read_text()
    assert "sleeper" not in rwlock  # DVC gave its locks back
    assert toy.dvc("status", "good") == set()


def test_a_group_that_does_not_listen_is_killed_after_the_grace() -> None:
    code = "import signal, time; signal.signal(2, signal.SIG_IGN); print(flush=True)"
    deaf = subprocess.Popen(
        [sys.executable, "-c", f"{code}; time.sleep(600)"], stdout=subprocess.PIPE, process_group=0
    )
    deaf.stdout.readline()
    start = time.monotonic()
    guard.end_group(deaf.pid, grace=0.3)
    assert deaf.wait(5) == -signal.SIGKILL
    assert time.monotonic() - start >= 0.3
