"""A toy project in several working copies, a DVC remote beside them, Dask processes in them."""

import re
import subprocess
import sys
from pathlib import Path

from tests.project import until, write_files
from validation.projects import ProjectCopy

STEP = """\
import os, pathlib, sys, time
out, *inputs = sys.argv[1:]
print("makes", out, flush=True)
with open("ran.log", "a") as log:
    print(out, os.getpid(), os.environ.get("SLING_DEVICE"), file=log)
begin = time.monotonic()
while pathlib.Path("wait").exists() and time.monotonic() < begin + 120:
    time.sleep(0.05)
if os.environ.get("FAIL"):
    sys.exit("error: it fails")
path = pathlib.Path(out)
path.parent.mkdir(parents=True, exist_ok=True)
path.write_text("".join(pathlib.Path(one).read_text() for one in inputs) + out + "\\n")
"""
STAGES = """\
stages:
  search:
    matrix: {band: [a, b]}
    cmd: python step.py data/search/${item.band} params.yaml
    deps: [step.py, recordings]
    params: [seed]
    outs: ['data/search/${item.band}']
  train:
    cmd: python step.py data/train/b data/search/b
    deps: [step.py, data/search/b]
    outs: [data/train/b]
    meta: {gpu: true}
  report:
    cmd: python step.py report.md data/search/a data/train/b
    deps: [step.py, data/search/a, data/train]
    outs:
      - report.md: {cache: false}
"""
CONFIG = """\
[core]
    analytics = false
    check_update = false
    autostage = false
    remote = shared
['remote "shared"']
    url = {remote}
"""


class Copy(ProjectCopy):
    """A working copy of the toy project."""

    def clone(self, name: str) -> "Copy":
        self("git", "clone", "-q", ".", str(self.folder.parent / name))
        return Copy(self.folder.parent / name)

    @property
    def ran(self) -> list[list[str]]:
        """Output, process and device of each stage that ran here."""
        log = self.folder / "ran.log"
        return [line.split() for line in log.read_text().splitlines()] if log.exists() else []


def toy(folder: Path) -> Copy:
    """The toy project in a Git repository, with a folder beside it as its DVC remote."""
    files = {
        ".dvc/config": CONFIG.format(remote=folder.parent / "remote"),
        ".dvc/.gitignore": "/config.local\n/tmp\n/cache\n",
        ".gitignore": "/data/\n/ran.log\n/wait\n/.checkpoints/\n",
        "step.py": STEP,
        "dvc.yaml": STAGES,
        "params.yaml": "seed: 1\n",
        "recordings/a": "a recording\n",
    }
    write_files(folder, files)
    copy = Copy(folder)
    copy.commit()
    return copy


class Dask:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, logs: Path) -> None:
        self.logs, self.processes = logs, {}

    def start(self, name: str, copy: Copy, *command: str, **environment: str) -> str:
        """Start one; what its log says of its address."""
        log = self.logs / f"{name}.log"
        with log.open("w") as file:
            self.processes[name] = subprocess.Popen(
                [sys.executable, "-m", *command, "--host", "127.0.0.1", "--no-dashboard"],
                cwd=copy.folder,
                env={**copy.environment, **environment},
                stdout=file,
                stderr=subprocess.STDOUT,
            )
        match = until(
            lambda: re.search(r"(?:Scheduler at|Start worker at): +(tcp://\S+)", log.read_text())
        )
        return match[1]

    def stop(self) -> None:
        for process in reversed(self.processes.values()):
            process.terminate()
        for process in self.processes.values():
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


class Several:
    """A head, and two workers with working copies of their own; one has a GPU, so it says."""

    def __init__(self, folder: Path) -> None:
        self.head = toy(folder / "head")
        self.plain, self.gpu = self.head.clone("plain"), self.head.clone("gpu")
        self.dask = Dask(folder)
        self.address = self.dask.start(
            "scheduler", self.head, "distributed.cli.dask_scheduler", "--port", "0"
        )
        start = ("distributed.cli.dask_worker", self.address, "--nthreads", "1", "--no-nanny")
        self.dask.start("plain", self.plain, *start)
        self.dask.start("gpu", self.gpu, *start, "--resources", "GPU=1", SLING_DEVICE="cuda:7")
