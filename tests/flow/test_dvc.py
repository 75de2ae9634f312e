"""What DVC says of stages, and why one of its commands failed."""

import subprocess
from pathlib import Path

import pytest

from pipeline.flow.dvc import cause, environment, named, repro, stale
from sling2sim2real.base.errors import UserError
from tests.flow.toy import Toy, stage

STAGES = ("theta@band1-paper", "theta@band1-de", "report")
RUNS = ("Running stage 'one':", "> sh one")


@pytest.mark.parametrize(
    ("target", "found"),
    [
        ("theta@band1-paper", {STAGES[0]}),
        ("theta", {*STAGES[:2]}),
        ("report", {STAGES[2]}),
    ],
)
def test_a_target_is_a_stage_or_a_step(target: str, found: set[str]) -> None:
    assert named(target, STAGES) == found


@pytest.mark.parametrize("target", ["band1-de", "port", "theta@", "theta@band1-d."])
def test_any_other_target_is_refused(target: str) -> None:
    with pytest.raises(UserError, match="no stage of dvc.yaml; `dvc stage list` has all"):
        named(target, STAGES)


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (("error: mass: is 0", "failed with: 1"), "mass: is 0"),
        (("Traceback", "KeyError: 'a'", "failed with: 1"), "KeyError: 'a' (exit status 1)"),
        (("half a line", "failed with: -9"), "was killed by signal 9"),
        (("ERROR: failed to reproduce 'one': a.txt does not exist",), "a.txt does not exist"),
        (("ERROR: failed to reproduce 'one': 'a' is busy:", "  (PID 1)"), "'a' is busy: (PID 1)"),
    ],
)
def test_why_a_command_failed(lines: tuple[str, ...], expected: str) -> None:
    """The last line is what DVC says of a stage's exit status."""
    *own, last = lines
    if last.startswith("failed with: "):
        last = f"ERROR: failed to reproduce 'one': failed to run: sh one, exited with {last[13:]}"
    assert cause([*RUNS, *own, last], 255) == expected


@pytest.fixture
def toy(tmp_path: Path) -> Toy:
    stages = {
        "one": stage("echo 1 >> runs; echo 1 > one.txt", "one.txt"),
        "two": stage("echo line; cp one.txt two.txt", "two.txt", "one.txt"),
        "three": stage("[ ! -e bad ] && cp two.txt three.txt", "three.txt", "two.txt"),
        "other": stage("echo 1 > other.txt", "other.txt"),
    }
    return Toy(tmp_path, stages)


def run(toy: Toy, *stages: str) -> list[str]:
    """Have DVC run stages one by one; their lines, and DVC's of each."""
    lines: list[str] = []
    for name in stages:
        repro(toy.folder, name, environment(1), lines.append)
    return lines


@pytest.mark.slow
def test_what_is_stale_is_run_with_its_lines_and_a_failure_says_why(toy: Toy) -> None:
    graph = stale(toy.folder, ["two"])
    assert {*graph} == {"one", "two"} and {*graph.edges} == {("one", "two")}
    assert run(toy, "one", "two") == ["Running stage 'one':", "Running stage 'two':", "line"]
    (toy.folder / "bad").touch()
    with pytest.raises(UserError, match=r"^said nothing \(exit status 1\)$"):
        run(toy, "three")
    assert {*stale(toy.folder)} == {"three", "other"}


@pytest.mark.slow
def test_a_lock_that_was_cut_off_is_one_line_and_gits_brings_back_what_is_done(toy: Toy) -> None:
    lock = toy.folder / "dvc.lock"
    run(toy, "one")
    for command in ("git add -A", "git -c user.name=a -c user.email=a@b commit -qm one"):
        subprocess.run(command.split(), cwd=toy.folder, check=True)
    run(toy, "two", "three")
    whole = lock.read_text()
    lock.write_text(whole[:10])
    for what in (stale, lambda folder: repro(folder, "three", environment(1), print)):
        with pytest.raises(UserError, match="dvc.lock was cut off .* `git checkout dvc.lock`"):
            what(toy.folder)
    subprocess.run(["git", "checkout", "-q", "dvc.lock"], cwd=toy.folder, check=True)
    assert {*stale(toy.folder)} == {"two", "three", "other"}
    output = run(toy, "two", "three")
    assert sum("is cached - skipping run" in line for line in output) == 2
    assert lock.read_text() == whole and toy.read("runs") == "1"
