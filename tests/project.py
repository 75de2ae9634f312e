"""Commands, copies of the project and processes, for tests that run them."""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil

from pipeline.params import Params
from pipeline.params.identification import steps_of
from pipeline.params.lab import StepParams

ROOT = Path(__file__).parents[1]
SLING = ("-c", "from app.cli import main; main()")  # after `python`
ROUGH = {  # a sling's
    "edges": 16,
    "grip_step": 0.01,
    "hold_step": 0.02,
    "recoil_step": 5e-4,
    "swing_step": 2e-3,
}


def copy_project(folder: Path) -> None:
    """Copy into `folder` what Git would commit, but for dvc.lock: every stage is stale there."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    ).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file() and name != "dvc.lock":
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name, follow_symlinks=False)


def environment(**more: str) -> dict[str, str]:
    """Ours, with this Python and this project first, one thread a process, and `more`."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ours = {"PATH": path, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    return {**os.environ, **ours, **more}


def python(*arguments: str | Path, folder: Path = ROOT, **more: str) -> subprocess.CompletedProcess:
    """Run Python in `folder`, with `more` in its environment."""
    command, about = [sys.executable, *map(str, arguments)], {"capture_output": True, "text": True}
    return subprocess.run(command, cwd=folder, env=environment(**more), timeout=240, **about)


def set_methods(content: dict, methods: list[str], ablations: list[str] | tuple = ()) -> None:
    """Write into the content of a params.yaml which methods run, and by which steps."""
    searches = content["methods"], content["method_defaults"]["search"]
    for run, names in ((content["run"], methods), (content["run"]["ablations"], ablations)):
        run["methods"], run["steps"] = list(names), {step: [] for step in StepParams.model_fields}
        for name in names:
            for step in steps_of(searches[0][name].get("search", searches[1])):
                if step in run["steps"]:
                    run["steps"][step].append(name)


def with_(params: Params, section: str, **values: object) -> Params:
    """`params` with other values in a section, such as rig.camera."""
    first, _, rest = section.partition(".")
    inner = getattr(params, first)
    inner = with_(inner, rest, **values) if rest else inner.model_copy(update=values)
    return params.model_copy(update={first: inner})


class Copy:
    """A folder in which a test runs commands, with `more` in their environment."""

    def __init__(self, folder: Path, **more: str) -> None:
        self.folder = folder
        site = str(folder.parent / f"site-{folder.name}")
        self.environment = environment(DVC_SITE_CACHE_DIR=site, **more)

    def __call__(self, *command: str) -> str:
        """What a command prints; the test fails where that fails."""
        about = {"cwd": self.folder, "env": self.environment, "capture_output": True}
        done = subprocess.run(command, text=True, timeout=1200, **about)
        assert done.returncode == 0, f"{' '.join(command)}:\n{done.stdout}\n{done.stderr}"
        self.errors = done.stderr
        return done.stdout

    def dvc(self, *arguments: str) -> set[str]:
        """Run DVC; the stages that really ran."""
        return set(re.findall(r"^Running stage '(.+)':$", self("dvc", *arguments), re.MULTILINE))


def wait(happens: Callable[[], object], seconds: float):
    """What it gives once that is true, or after so long."""
    latest = time.monotonic() + seconds
    while not (found := happens()) and time.monotonic() < latest:
        time.sleep(0.05)
    return found


def until(happens: Callable[[], object], seconds: float = 90.0):
    """The same, where the test fails after so long."""
    found = wait(happens, seconds)
    assert found, f"it did not come to pass within {seconds} s"
    return found


def alive(pid: int) -> bool:
    """A zombie is not: it waits for a parent to look at it."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
