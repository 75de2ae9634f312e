"""Whatever ends a flow or a stage: nothing lives on, no lock stays, and the next run goes on."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from app.flow import guard, whole
from app.flow.child import StageFailed, run_stage
from app.flow.locks import mend
from tests.app.flow.killing import OUTPUTS, SLING, STEPS, Toy, send, told, wait

pytestmark = pytest.mark.slow
READY = 90.0  # s in which a flow must have begun its stages, or ended them, on a busy machine
FLOW = (*SLING, "flow", "--workers", "2")
ONE = {"out/a.txt": OUTPUTS["out/a.txt"]}


@pytest.fixture
def toy(tmp_path):
    toy = Toy(tmp_path / "toy")
    yield toy
    toy.run.left(0)


@pytest.fixture
def flows(toy, history) -> Toy:
    """The same, in which flows need not make Prefect's history."""
    shutil.copytree(history, toy.folder / ".prefect")
    return toy


def steps(text: str) -> int:
    return sum("step" in line for line in text.splitlines())


def ran(text: str) -> set[str]:
    """Stages that DVC really ran, by what it said."""
    return set(re.findall(r"^Running stage '(.+)':$", text, re.MULTILINE))


def kept(toy: Toy, name: str) -> int:
    """Steps that a stage has behind it."""
    path = toy.folder / ".checkpoints" / name
    return int(path.read_text()) if path.exists() else 0


def temporaries(toy: Toy) -> list[Path]:
    return [file for file in toy.folder.rglob("*.tmp") if file.is_file()]


@pytest.mark.parametrize(
    ("send_to", "number", "done"),
    [
        (os.killpg, signal.SIGINT, set()),  # as a terminal does
        (os.kill, signal.SIGTERM, {"count@b"}),
    ],
)
def test_an_interrupted_flow_ends_its_stages_and_dvc_goes_on(flows, send_to, number, done) -> None:
    """While two stages run; while one does, and another is done."""
    toy = flows
    (toy.folder / ".checkpoints").mkdir()
    for name in done:
        (toy.folder / ".checkpoints" / name[-1]).write_text(str(STEPS))
    toy.run.environment["PACE"] = "0.5"  # s a step, which DVC may take to put away the one's output
    flow = toy.run.start(*FLOW)
    begun = ["step 4", *(f"{name} | done" for name in done)]
    assert wait(lambda: all(one in toy.run.said for one in begun), READY), toy.run.said
    send_to(flow.pid, number)
    assert flow.wait(guard.GRACE + 25) == 130
    assert toy.run.left() == []
    assert "Traceback" not in toy.run.said
    assert "stages: " not in toy.run.said  # the summary of one that came to its end
    assert toy.run.said.splitlines()[-1] == "interrupted"
    rwlock = json.loads((toy.folder / ".dvc/tmp/rwlock").read_text() or "{}")
    assert not any(rwlock.values())
    del toy.run.environment["PACE"]
    again = toy.dvc("repro")
    assert ran(again) == {"count@a", "count@b", "both"} - done
    assert steps(again) <= (2 - len(done)) * STEPS - 4  # from where they were interrupted
    assert toy.outputs() == OUTPUTS
    assert not temporaries(toy)


def struck(toy: Toy, victim: str, rng: np.random.Generator) -> int:
    """Start a flow, kill it or a process of it soon after its stages begin; its exit status.

    Prefect's server is spared: without it a flow takes a minute to end.
    """
    flow = toy.run.start(*FLOW)

    def ended() -> bool:
        return flow.poll() is not None

    assert wait(lambda: " | begins" in toy.run.said or ended(), READY), toy.run.said
    wait(ended, rng.uniform(0, 2))
    others = [
        one for one in toy.run.alive() if one.pid != flow.pid and "flow.server" not in told(one)
    ]
    if victim == "flow":
        flow.kill()
    elif others:
        send(others[rng.integers(len(others))])
    return flow.wait(READY)


def test_flows_are_killed_at_random_moments_and_the_next_one_goes_on(flows: Toy) -> None:
    """Of the real stages, and to the same bytes: validation/campaigns/test_kills.py."""
    toy, rng = flows, np.random.default_rng(1)
    for victim in ("flow", "process"):
        status = struck(toy, victim, rng)
        assert toy.run.left() == []
        assert "Traceback" not in toy.run.said
        if victim == "flow":
            assert status == -signal.SIGKILL
        elif status:  # else it was at its end, or nothing hung on it
            assert status == 1 and toy.run.said.splitlines()[-1].startswith("error: ")
    remaining = sum(STEPS - kept(toy, name) for name in "ab")
    flow = toy.run.start(*FLOW)
    assert flow.wait(READY) == 0, toy.run.said
    assert steps(toy.run.said) == remaining  # from where they were killed
    assert toy.outputs() == OUTPUTS
    assert not temporaries(toy)
    assert not ran(toy.dvc("repro"))


CHILD = """\
import os, sys
from pathlib import Path
from pipeline.base.errors import UserError
from app.flow.child import run_stage
try:
    run_stage(Path.cwd(), "count@a", environment=os.environ, on_line=print)
except UserError as error:
    sys.exit(f"failed: {error}")
"""


@pytest.mark.parametrize(
    ("victim", "reason"),
    [
        ("work.py", "was killed by signal 9"),
        ("repro", "DVC was killed by signal 9"),
        ("guard.py", "its guard was killed by signal 9"),
    ],
)
def test_a_killed_stage_fails_with_one_line_and_leaves_nothing(toy: Toy, victim, reason) -> None:
    """The stage, DVC around it, or the guard around both."""
    child = toy.run.start(sys.executable, "-u", "-c", CHILD)
    assert wait(lambda: "step 3" in toy.run.said, READY), toy.run.said
    python = [one for one in toy.run.named(victim) if one.name().startswith("python")]
    found = [one for one in python if victim != "repro" or "guard" not in told(one)]
    assert len(found) == 1, [told(one) for one in toy.run.alive()]
    send(found[0])
    assert child.wait(20) == 1
    last = toy.run.said.splitlines()[-1]
    assert last == f"failed: count@a: {reason}"
    assert "Traceback" not in toy.run.said
    assert toy.run.left() == []
    assert steps(toy.dvc("repro", "count@a")) <= STEPS - 3
    assert toy.outputs() == ONE


@pytest.mark.parametrize("shell", ["/bin/sh", "/bin/bash"])
def test_a_stage_that_crashes_fails_with_its_signal(toy: Toy, shell: str) -> None:
    """DVC starts a stage by the user's shell: dash stays around it, bash becomes it."""
    if not Path(shell).exists():
        pytest.skip(f"there is no {shell}")
    environment = toy.run.environment | {"ABORT": "a", "SHELL": shell}
    with pytest.raises(StageFailed, match="^count@a: was killed by signal 6$"):
        run_stage(toy.folder, "count@a", environment=environment, on_line=lambda line: None)
    assert toy.run.left() == []


@pytest.fixture
def disk(tmp_path):
    """A small disk, and what fills it but for so many bytes."""
    if os.geteuid() != 0:
        pytest.skip("only root may mount a small disk")
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", folder], capture_output=True, text=True
    )
    if mounted.returncode:
        pytest.skip(f"no small disk can be mounted: {mounted.stderr.strip()}")
    yield folder
    subprocess.run(["umount", "--lazy", folder], check=True)


@pytest.mark.parametrize("free", [8, 600])
def test_a_full_disk_is_one_clear_line_and_room_is_all_it_needs(disk: Path, free: int) -> None:
    """No room [kB] for what the stage writes, or for DVC's copy of it."""
    toy = Toy(disk / "toy")
    toy.run.environment |= {"SIZE": "400000", "DVC_SITE_CACHE_DIR": str(disk.parent / "site")}
    (toy.folder / ".checkpoints").mkdir()
    for name in "ab":
        (toy.folder / ".checkpoints" / name).write_text(str(STEPS))
    ballast = disk / "ballast"
    with ballast.open("wb") as file:
        file.write(b"0" * (shutil.disk_usage(disk).free - 1000 * free))
    with pytest.raises(StageFailed, match="No space left on device") as failure:
        run_stage(toy.folder, "count@a", environment=toy.run.environment, on_line=lambda line: None)
    assert "\n" not in str(failure.value)
    ballast.unlink()
    mend(toy.folder)  # as the next flow does
    assert not temporaries(toy)
    toy.dvc("repro")
    assert toy.outputs()["out/a.txt"] == "a" * 400_000 + "\n"


def test_dvc_lock_stays_whole_where_it_cannot_be_written(toy: Toy) -> None:
    """As on a full disk: no file may grow beyond a third of it."""
    toy.dvc("repro", "count@a")
    lock = toy.folder / "dvc.lock"
    lock.write_text(f"{lock.read_text()}  other:\n    cmd: cat {'x' * 800_000}\n")
    before = lock.read_bytes()
    with (toy.folder / "work.py").open("a") as file:
        file.write("# changed\n")
    command = [sys.executable, "-P", whole.__file__, "repro", "-s", "count@a"]
    limited = f"ulimit -f {len(before) // 3 // 1024}; exec {shlex.join(command)}"
    dvc = toy.run.start("bash", "-c", limited)
    assert dvc.wait(60) and "File too large" in toy.run.said
    assert lock.read_bytes() == before
    toy.dvc("repro", "count@a")
    assert toy.outputs() == ONE and lock.read_bytes() != before


def test_dvcs_locks_of_the_dead_are_released_and_those_of_the_living_kept(toy: Toy) -> None:
    path = toy.folder / ".dvc/tmp/rwlock"
    path.parent.mkdir()
    mend(toy.folder)
    assert not path.exists()
    code = "import time; time.sleep(60)"
    living = subprocess.Popen([sys.executable, "-c", code, "repro", "-s", "count@a"])
    try:
        alive = {"pid": living.pid, "cmd": "dvc repro -s count@a"}
        other = {"pid": os.getpid(), "cmd": "dvc repro -s count@b"}  # a number that lives again
        held = {"write": {"/a": alive, "/b": other}, "read": {"/c": [alive, other], "/d": [other]}}
        path.write_text(json.dumps(held))
        mend(toy.folder)
        assert json.loads(path.read_text()) == {"write": {"/a": alive}, "read": {"/c": [alive]}}
    finally:
        living.kill()
        living.wait()
    for damaged in ("", '{"write": {', "[]", '{"write": {"/a": 1}}'):
        path.write_text(damaged)
        mend(toy.folder)
        assert not path.exists()
