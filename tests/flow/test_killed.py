"""Whatever ends a flow or a stage: nothing lives on, no lock stays, and the next run goes on."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.flow import whole
from pipeline.flow.child import StageFailed, run_stage
from pipeline.flow.locks import mend
from tests.flow.killing import OUTPUTS, SLING, STEPS, Toy, send, told, wait

pytestmark = pytest.mark.slow
READY = 90.0  # s in which a flow must have begun its stages, on a busy machine


@pytest.fixture
def toy(tmp_path):
    toy = Toy(tmp_path / "toy")
    yield toy
    toy.run.left(0)


@pytest.fixture(params=["/bin/sh", "/bin/bash"])
def any_shell(toy: Toy, request) -> Toy:
    """DVC starts a stage by the user's shell: dash stays around it, bash becomes it."""
    if not Path(request.param).exists():
        pytest.skip(f"there is no {request.param}")
    toy.run.environment |= {"SHELL": request.param}
    return toy


def steps(text: str) -> int:
    return sum("step" in line for line in text.splitlines())


def temporaries(toy: Toy) -> list[Path]:
    return [file for file in toy.folder.rglob("*.tmp") if file.is_file()]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_flow_that_is_ended_takes_its_stages_along(toy: Toy, number: int) -> None:
    flow = toy.run.start(*SLING, "flow", "--workers", "2")
    assert wait(lambda: "step 4" in toy.run.said, READY), toy.run.said
    flow.send_signal(number)
    assert flow.wait(30) == {signal.SIGKILL: -signal.SIGKILL}.get(number, 130)
    assert toy.run.left() == []
    assert "Traceback" not in toy.run.said
    if number != signal.SIGKILL:
        assert toy.run.said.splitlines()[-1] == "interrupted"
    again = toy.dvc("repro")  # tests/validation/test_kills.py goes on by `sling flow`
    assert steps(again) <= 2 * STEPS - 4  # from where they were killed
    assert toy.outputs() == OUTPUTS
    assert not temporaries(toy)
    assert "didn't change" in toy.dvc("repro")


CHILD = """\
import os, sys
from pathlib import Path
from pipeline.errors import UserError
from pipeline.flow.child import run_stage
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
def test_a_killed_stage_fails_with_one_line_and_leaves_nothing(any_shell, victim, reason) -> None:
    """The stage, DVC around it, or the guard around both."""
    toy = any_shell
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
    assert steps(toy.dvc("repro")) < 2 * STEPS
    assert toy.outputs() == OUTPUTS


def test_a_stage_that_crashes_fails_with_its_signal(any_shell: Toy) -> None:
    toy = any_shell
    environment = toy.run.environment | {"ABORT": "a"}
    with pytest.raises(StageFailed, match="^count@a: was killed by signal 6$"):
        run_stage(toy.folder, "count@a", environment=environment, on_line=lambda line: None)
    assert toy.run.left() == []
    toy.dvc("repro")
    assert toy.outputs() == OUTPUTS


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
    toy.dvc("repro")
    lock = toy.folder / "dvc.lock"
    entry = "    - path: other\n      hash: md5\n      md5: {}\n      size: 1\n"
    more = "".join(entry.format(f"{n:031x}a") for n in range(8000))
    lock.write_text(lock.read_text() + f"  other:\n    cmd: cat other\n    deps:\n{more}")
    before = lock.read_bytes()
    with (toy.folder / "work.py").open("a") as file:
        file.write("# changed\n")
    command = [sys.executable, "-P", whole.__file__, "repro", "-s", "count@a"]
    limited = f"ulimit -f {len(before) // 3 // 1024}; exec {shlex.join(command)}"
    dvc = toy.run.start("bash", "-c", limited)
    assert dvc.wait(60) and "File too large" in toy.run.said
    assert lock.read_bytes() == before
    toy.dvc("repro")
    assert toy.outputs() == OUTPUTS and lock.read_bytes() != before


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
