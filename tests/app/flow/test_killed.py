"""Whatever ends a flow or a stage: nothing lives on, no lock stays, and the next run goes on."""

import json
import os
import shutil
import signal
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from app.flow import guard
from app.flow.child import StageFailed, run_stage
from stages import dvc_files
from tests.app.flow.killing import OUTPUTS, STEPS, Toy
from validation.projects import SLING, command_line, send, wait

pytestmark = pytest.mark.slow
READY = 90.0  # s in which a flow must have begun its stages, or ended them, on a busy machine
FLOW = (*SLING, "flow", "--workers", "2")


@pytest.fixture
def toy(tmp_path):
    toy = Toy(tmp_path / "toy")
    yield toy
    toy.run.left(0)


def steps(text: str) -> int:
    return sum("step" in line for line in text.splitlines())


def retained(toy: Toy, name: str) -> int:
    """Steps that a stage has behind it."""
    path = toy.folder / ".checkpoints" / name
    return int(path.read_text()) if path.exists() else 0


def temporaries(toy: Toy) -> list[Path]:
    return [file for file in toy.folder.rglob("*.tmp") if file.is_file()]


def test_flows_are_interrupted_and_killed_and_the_next_one_goes_on(toy: Toy) -> None:
    """One after the other; of the real stages, to the same bytes: validation/campaigns."""
    interrupted(toy, os.killpg, signal.SIGINT)  # as a terminal does
    interrupted(toy, os.kill, signal.SIGTERM)
    flow = at_work(toy)
    flow.kill()
    flow.wait()
    assert toy.run.left() == []
    assert "Traceback" not in toy.run.message
    remaining = sum(STEPS - retained(toy, name) for name in "ab")
    flow = toy.run.start(*FLOW)
    assert flow.wait(READY) == 0, toy.run.message
    assert steps(toy.run.message) == remaining  # from where they were killed
    assert toy.outputs() == OUTPUTS
    assert not temporaries(toy)
    assert toy.dvc("repro") == set()


def at_work(toy: Toy) -> subprocess.Popen:
    """A flow whose stages run."""
    before = retained(toy, "a")
    flow = toy.run.start(*FLOW)
    assert wait(lambda: retained(toy, "a") > before + 1, READY), toy.run.message
    return flow


def interrupted(toy: Toy, send_to, number: int) -> None:
    flow = at_work(toy)
    send_to(flow.pid, number)
    assert flow.wait(guard.GRACE + 25) == 130
    assert toy.run.left() == []
    assert "Traceback" not in toy.run.message
    assert "stages: " not in toy.run.message  # the summary of one that came to its end
    assert toy.run.message.splitlines()[-1] == "interrupted"
    rwlock = toy.folder / ".dvc/tmp/rwlock"  # so that `dvc repro` goes on too
    assert not rwlock.exists() or not any(json.loads(rwlock.read_text()).values())


def test_a_killed_stage_fails_with_one_line_and_leaves_nothing(toy: Toy) -> None:
    """The stage, DVC around it, or the guard around both; a crash, by either kind of shell.

    Dash stays around what DVC has it run, bash becomes it.
    """

    def run(lines: list[str], **environment: str) -> bool:
        environment = toy.environment | {"SHELL": "/bin/sh"} | environment
        return run_stage(toy.folder, "count@a", environment=environment, on_line=lines.append)

    for victim, reason in (
        ("work.py", "was killed by signal 9"),
        ("repro", "DVC was killed by signal 9"),
        ("guard.py", "its guard was killed by signal 9"),
    ):
        (toy.folder / ".checkpoints/a").unlink(missing_ok=True)
        lines: list[str] = []
        with ThreadPoolExecutor(1) as pool:
            stage = pool.submit(run, lines)
            assert wait(lambda: "step 3" in lines or stage.done(), READY)  # noqa: B023
            python = [
                process for process in toy.run.named(victim) if process.name().startswith("python")
            ]
            matches = [
                process
                for process in python
                if victim != "repro" or "guard" not in command_line(process)
            ]
            assert len(matches) == 1, [command_line(process) for process in toy.run.alive()]
            send(matches[0])
            with pytest.raises(StageFailed, match=f"^count@a: {reason}$"):
                stage.result(20)
        assert not any("Traceback" in line for line in lines)
        assert toy.run.left() == []
    lines = []
    assert run(lines) and 0 < len(lines) <= STEPS - 3
    assert toy.outputs() == {"out/a.txt": OUTPUTS["out/a.txt"]}
    (toy.folder / ".checkpoints/a").unlink()
    (toy.folder / "work.py").write_text(f"{(toy.folder / 'work.py').read_text()}#\n")
    shell = next(filter(os.path.exists, ("/bin/bash", "/bin/sh")))
    with pytest.raises(StageFailed, match="^count@a: was killed by signal 6$"):
        run([], ABORT="a", SHELL=shell)
    assert toy.run.left() == []


@pytest.fixture
def disk(tmp_path):
    """A small disk."""
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


def test_a_full_disk_is_one_clear_line_and_room_is_all_it_needs(disk: Path) -> None:
    """No room [kB] for what the stage writes, or for DVC's copy of it."""
    for free in (8, 600):
        toy = Toy(disk / "toy")
        toy.environment |= {"SIZE": "400000", "DVC_SITE_CACHE_DIR": str(disk.parent / "site")}
        (toy.folder / ".checkpoints").mkdir()
        (toy.folder / ".checkpoints/a").write_text(str(STEPS))
        ballast = disk / "ballast"
        with ballast.open("wb") as file:
            file.write(b"0" * (shutil.disk_usage(disk).free - 1000 * free))
        with pytest.raises(StageFailed, match="No space left on device") as failure:
            run_stage(toy.folder, "count@a", environment=toy.environment, on_line=lambda line: None)
        assert "\n" not in str(failure.value)
        ballast.unlink()
        dvc_files.mend(toy.folder)  # as the next flow does
        assert not temporaries(toy)
        toy.dvc("repro", "count@a")
        assert toy.outputs()["out/a.txt"] == "a" * 400_000 + "\n"
        shutil.rmtree(toy.folder)
