"""Stage scripts as a user calls them: every mistake is one line."""

import pickle
import runpy
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from sling2sim2real.base.files import NotMade
from stages.start import remedy
from tests.project import DEFAULTS, ROOT, alive, python, until
from validation.projects import environment

OF_A_RECORDING = ("record", "episode", "clamps", "card")
OF_A_PAIR = ("history", "clusters", "cma", "posterior", "search", "theta", "policy", "trials")


@pytest.fixture
def stage(tmp_path: Path, monkeypatch, capsys) -> Callable[..., tuple[int, str]]:
    """Run a script where nothing has run yet: its exit status and its one line on stderr."""
    (tmp_path / "params.yaml").write_bytes(DEFAULTS.read_bytes())
    monkeypatch.chdir(tmp_path)

    def run(name: str, *arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["", *arguments])
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(f"stages.{name}", run_name="__main__", alter_sys=True)
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1, lines
        return ended.value.code, lines[0]

    return run


def test_wrong_arguments_are_answered_by_the_usage(stage) -> None:
    for words, names in (
        (" RECORDING", OF_A_RECORDING),
        (" RECORDING-METHOD", OF_A_PAIR),
        (" BAND", ["floor"]),
        ("", ["report"]),
    ):
        for name in names:
            expected = (2, f"usage: python -m stages.{name}{words}")
            assert stage(name, "a", "b", "c") == expected
            assert not words or stage(name) == expected


def test_unknown_names(stage) -> None:
    status, line = stage("history", "band9-paper")
    assert status == 1
    assert line.startswith("error: band9-paper: not under run.pairs in params.yaml, which has band")
    status, line = stage("clamps", "band1-best")
    assert status == 1 and line.startswith("error: band1-best: not under run.recordings in params")


def test_missing_inputs(stage) -> None:
    for item, names in (
        (["band1-dips"], OF_A_RECORDING[1:]),
        (["band1-paper"], OF_A_PAIR),
        ([], ["report"]),
    ):
        for name in names:
            status, line = stage(name, *item)
            assert status == 1 and line.startswith("error: data/"), line
            assert "missing; `dvc repro` makes it" in line, line


@pytest.mark.parametrize(
    ("path", "problem", "says"),
    [
        ("data/clamps/band1/dips.json", "missing", "`dvc repro` makes it"),
        ("/data/x/data/confidence/band1-de.json", "damaged", "`dvc repro` makes it anew"),
        ("data/raw/a/plain/a.mcap", "missing", "`dvc repro` makes it; of a band of yours, put MC"),
        ("data/launches/mine.csv", "missing", "a CSV with the header draw_y,draw_z"),
        ("mine.json", "missing", ""),
        ("data", "missing", ""),
    ],
)
def test_a_file_that_is_missing_or_damaged_says_what_makes_it(path, problem, says) -> None:
    message = remedy(NotMade(Path(path), problem))
    assert message.startswith(says) and bool(message) == bool(says)


def test_a_missing_file_comes_back_from_another_process() -> None:
    error = pickle.loads(pickle.dumps(NotMade(Path("a.json"), "damaged")))
    assert (str(error), error.problem) == ("a.json: damaged", "damaged")


def test_a_stage_has_one_thread_of_blas_whatever_the_machine() -> None:
    """Several round otherwise: theta's confidence differed in its last digits."""
    code = "import stages, numpy, threadpoolctl as t;"
    code += "print([one['num_threads'] for one in t.threadpool_info()])"
    done = python("-c", code, OMP_NUM_THREADS="2", OPENBLAS_NUM_THREADS="2")
    assert done.stdout == "[1]\n", done.stderr


@pytest.mark.slow
def test_a_stage_imports_no_library_that_it_does_not_use() -> None:
    """Each costs seconds of a run's start: networks and meshes, plots, tables.

    In few processes, in which further stages are imported after those before.
    """
    names = [file.stem for file in (ROOT / "stages").glob("*.py")]
    light = [name for name in names if name not in ("__init__", *"policy report card".split())]
    assert len(light) >= 8
    without = [name for name in light if name != "episode"]
    heavy = "torch open3d matplotlib pandas sklearn cma onnx onnxruntime transformers rsl_rl"
    for steps in (
        [(without, f"{heavy} cv2"), (["episode"], heavy)],
        [(["record", "episode", "floor"], "warp")],
        [(["report"], "torch open3d cv2 cma"), (["card"], "torch cma")],
    ):
        code = "import sys\n"
        for stages, unused in steps:
            code += f"import {', '.join(f'stages.{name}' for name in stages)}\n"
            code += f"print(*set({unused.split()}) & sys.modules.keys())\n"
        done = python("-c", code)
        assert (done.returncode, done.stdout.split()) == (0, []), (steps, done)


@pytest.mark.parametrize(("after", "deaf"), [("", False), ("", True), ("; true", False)])
def test_a_stage_ends_with_its_dvc(after: str, deaf: bool, tmp_path: Path) -> None:
    """What stands for DVC starts it as DVC does.

    Args:
        after: With it the shell stays around the stage.
        deaf: To an interrupt, as in a shell's background.
    """
    (tmp_path / "stage.py").write_text(f"""
import os, pathlib, signal, time
from stages import start
if {deaf}:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
def main():
    pathlib.Path("pid").write_text(str(os.getpid()))
    time.sleep(60)
start.run(main)
""")
    command = ["/bin/sh", "-c", f"{sys.executable} stage.py{after}"]
    code = f"import os, subprocess; os.environ['DVC_STAGE'] = 'a'; subprocess.run({command})"
    dvc = subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, env=environment())
    until(lambda: (tmp_path / "pid").is_file() and (tmp_path / "pid").read_text())
    pid = int((tmp_path / "pid").read_text())
    time.sleep(1)
    assert alive(pid)
    dvc.kill()
    dvc.wait()
    until(lambda: not alive(pid), 30)


def test_a_stage_ends_with_the_command_that_started_its_dvc(tmp_path: Path) -> None:
    """By a kill, which leaves DVC: it sees that the stage has failed, and gives its locks back."""
    script = "import time; from stages.start import run; run(lambda: time.sleep(60))"
    flow = subprocess.Popen(["sleep", "60"])
    variables = environment(DVC_STAGE="a", SLING_FLOW=str(flow.pid))
    stage = subprocess.Popen([sys.executable, "-c", script], cwd=tmp_path, env=variables)
    time.sleep(2)
    assert stage.poll() is None
    flow.kill()
    flow.wait()
    assert stage.wait(20) == 130
