"""The four commands that are struck, each in a copy of the project on a tiny budget."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import psutil
from ruamel.yaml import YAML, YAMLError

from pipeline.base.code import ROOT
from pipeline.base.files import write_json
from pipeline.base.machine import commit
from stages import dvc_files
from validation.projects import (
    SLING,
    TINY,
    MarkedRun,
    ProjectCopy,
    copy_project,
    marked,
    run_of,
    set_params,
    wait,
)

BUDGET = TINY | run_of(["band1"], ["sling2sim2real"])  # the fit's: least_squares
SOURCE = "project"
RECORDING, NAME = "mine.mcap", "mine"  # of the fit
MASS = 0.023  # kg, of band1, whose recording it is
OF_CAMPAIGN = "SLING_KILLS"  # in the environment of all that a campaign starts
STARTED = 90.0  # s in which Dask must be up


def source(work: Path) -> Path:
    """The project as it is, on the tiny budget; what is there stays, whatever becomes of ours."""
    folder, temporary = work / SOURCE, work / f"{SOURCE}.tmp"
    if not folder.is_dir():
        shutil.rmtree(temporary, ignore_errors=True)
        temporary.mkdir()
        copy_project(temporary)
        set_params(temporary, BUDGET)
        write_json(work / "source.json", {"commit": commit(ROOT)})
        temporary.rename(folder)
    return folder


class StruckCopy(ProjectCopy):
    """A working copy whose command is struck again and again, until it ends well.

    Attributes:
        name: Of the command.
        words: Its command line.
        disk: A folder, or a small disk, that holds the copy and all that it makes, but not what
            the command says, and no temporary files of the system.
        run: Its processes, which bear a mark.
    """

    name: str
    words: tuple[str, ...] = ()
    values: Mapping[str, object] = {}  # of params.yaml, beside the budget
    stages: tuple[str, ...] = ()  # that it is to bring up to date; none: all

    def __init__(self, place: Path, work: Path) -> None:
        self.place, self.disk, temporary = place, place / "disk", place / "tmp"
        super().__init__(
            self.disk / "copy", SLING_WORKERS="1", TMPDIR=str(temporary), **{OF_CAMPAIGN: str(work)}
        )
        self.environment["DVC_SITE_CACHE_DIR"] = str(place / "site")
        temporary.mkdir(parents=True, exist_ok=True)
        self.run = MarkedRun(self.folder, place / "said.txt", **self._more())

    def _more(self) -> dict[str, str]:
        """What it has in its environment that we have not."""
        ours = os.environ
        return {name: value for name, value in self.environment.items() if ours.get(name) != value}

    @property
    def copies(self) -> list[Path]:
        """Working copies in which stages run."""
        return [self.folder]

    @property
    def services(self) -> list[psutil.Process]:
        """Processes that serve the command and outlive it."""
        return []

    def begin(self) -> None:
        """Start from scratch, as if nothing had ever run here."""
        shutil.rmtree(self.folder, ignore_errors=True)
        source = Path(self.environment[OF_CAMPAIGN], SOURCE)
        shutil.copytree(source, self.folder, symlinks=True)
        set_params(self.folder, self.values)
        self.commit()

    def start(self) -> subprocess.Popen:
        return self.run.start(*self.words)

    def left(self, seconds: float) -> list[str]:
        """Commands of what lives still after so long, services apart; it is ended then."""
        return self.run.left(seconds, [service.pid for service in self.services])

    def mend(self) -> bool:
        """What docs/flow.md advises before this command is begun again; whether it was needed."""
        return False

    def end(self) -> None:
        """End the services."""


class ReproCopy(StruckCopy):
    """`dvc repro`."""

    name = "dvc repro"
    words = (sys.executable, "-m", "dvc", "repro")

    def mend(self) -> bool:
        """DVC reads no half dvc.lock, and no half list of who holds what; `sling flow` mends them.

        What follows does what it does at its begin, without the rest of it.
        """
        half = False
        for name, read in (("dvc.lock", YAML(typ="safe").load), (".dvc/tmp/rwlock", json.loads)):
            file = self.folder / name
            try:
                half |= file.is_file() and not isinstance(read(file.read_text() or "{}"), dict)
            except (ValueError, YAMLError):
                half = True
        if half:
            dvc_files.mend(self.folder)
        return half


class FlowCopy(StruckCopy):
    """`sling flow`, two stages at a time."""

    name = "sling flow"
    words = (*SLING, "flow", "--workers", "2")


class FitCopy(StruckCopy):
    """`sling fit` of a recording that the project does not know yet."""

    name = "sling fit"
    values = run_of(["band1"], ["least_squares"])
    stages = (f"own_card@{NAME}",)
    words = (*SLING, "fit", RECORDING, "--mass", str(MASS), "--name", NAME)

    def begin(self) -> None:
        super().begin()
        shutil.copy(Path(self.environment[OF_CAMPAIGN], RECORDING), self.folder)


class ClusterCopy(StruckCopy):
    """`sling flow --cluster`, with a scheduler and a worker that has a working copy of its own.

    A scheduler or worker that was killed is started again before the next flow.
    """

    name = "cluster"

    def __init__(self, place: Path, work: Path) -> None:
        super().__init__(place, work)
        self._dask: dict[str, subprocess.Popen] = {}
        self._address = ""

    @property
    def copies(self) -> list[Path]:
        return [self.folder, self.disk / "worker"]

    @property
    def services(self) -> list[psutil.Process]:
        return [
            psutil.Process(process.pid) for process in self._dask.values() if process.poll() is None
        ]

    def begin(self) -> None:
        self.end()
        for name in ("worker", "remote"):
            shutil.rmtree(self.disk / name, ignore_errors=True)
        super().begin()
        self("dvc", "remote", "add", "-d", "shared", str(self.disk / "remote"))
        self("git", "commit", "-q", "-m", "remote", ".dvc/config")
        self("git", "clone", "-q", ".", str(self.disk / "worker"))

    def start(self) -> subprocess.Popen:
        if not self._lives("scheduler"):
            self._end("worker")
            words = ("-m", "distributed.cli.dask_scheduler", "--port", "0")
            self._address = self._serve("scheduler", self.place, words, "Scheduler at")
        if not self._lives("worker"):
            words = ("-m", "distributed.cli.dask_worker", self._address, "--nthreads", "1")
            words += ("--no-nanny", "--local-directory", self.environment["TMPDIR"])
            self._serve("worker", self.disk / "worker", words, "Start worker at")
        return self.run.start(*SLING, "flow", "--cluster", self._address)

    def _lives(self, name: str) -> bool:
        return name in self._dask and self._dask[name].poll() is None

    def _serve(self, name: str, folder: Path, words: tuple[str, ...], says: str) -> str:
        """Start a service; the address that it says. Raises RuntimeError."""
        log = self.place / f"{name}.log"
        with log.open("w") as file:
            self._dask[name] = subprocess.Popen(
                [sys.executable, *words, "--host", "127.0.0.1", "--no-dashboard"],
                cwd=folder,
                env=self.run.environment | {"DVC_SITE_CACHE_DIR": str(self.place / f"site-{name}")},
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        address = re.compile(rf"{says}: +(tcp://\S+)")
        if not (match := wait(lambda: address.search(log.read_text()), STARTED)):
            raise RuntimeError(f"Dask's {name} does not start: {log.read_text()[-500:]}")
        return match[1]

    def _end(self, name: str) -> None:
        if self._lives(name):
            self._dask[name].kill()
            self._dask[name].wait()

    def end(self) -> None:
        for name in ("worker", "scheduler"):
            self._end(name)


COMMANDS = {command.name: command for command in (ReproCopy, FlowCopy, FitCopy, ClusterCopy)}


def orphans(work: Path) -> list[psutil.Process]:
    """What a killed campaign in the same folder has left."""
    return marked(OF_CAMPAIGN, str(work))
