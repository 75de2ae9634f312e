"""Copies of the project, commands in them, and every process that such a command starts."""

from __future__ import annotations

import copy
import os
import re
import shutil
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import psutil
from ruamel.yaml import YAML

from pipeline.layout import ROOT
from pipeline.params import Params, load
from pipeline.params.run import PLAIN, UNIONS

DEFAULTS = ROOT / "params.yaml"
CLI = (
    "-c",
    "from sling2sim2real.cli.cli import main; main()",
)  # after `python`: this project's `sling`
SLING = (sys.executable, *CLI)
PROMPT = 10.0  # s after which no process of a command that has ended may live
MARK = "SLING_TEST_RUN"  # in the environment of every process of a MarkedRun
ROUGH = {  # keys of `sling` for a fast simulation
    "edges": 16,
    "grip_step": 0.01,
    "hold_step": 0.02,
    "recoil_step": 5e-4,
    "swing_step": 2e-3,
}
TINY = {  # keys of params.yaml for a whole run of a band in minutes
    "cloud.points": 100,
    "cloud.sampling": "after_filters",  # so few farthest points would all count as strays
    **{f"sling.{name}": value for name, value in ROUGH.items()},
    "optimizer.population": 6,
    "optimizer.generations": 2,
    "optimizer.k_nn": 6,
    "optimizer.k_top": 2,
    "optimizer.cma_population": 4,
    "optimizer.cma_rollouts": 8,
    "policy.map_size": [7, 7],
    "policy.envs": 32,
    "policy.iterations": 3,
    "trials.targets": [1.925],
    "trials.repeats": 1,
    "floor.map_size": [4, 4],
    "floor.launches": 1,
    "rig.edges": 16,
    "rig.tolerance": 1e-3,
    "rig.camera.drop_rate": 0.8,
}
Value = TypeVar("Value")


def copy_project(folder: Path) -> None:
    """Copy into `folder` what Git would commit.

    There is no dvc.lock: every stage is stale there.
    """
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


def changed(params: Params, values: Mapping[str, object]) -> Params:
    """Parameters with other values, by keys with dots, checked again."""
    content = params.model_dump(mode="json", exclude_unset=True)
    _set(content, values)
    return type(params).model_validate(content)


def with_section(params: Params, name: str, **values: object) -> Params:
    """Parameters with other values in one section, which are not checked."""
    return params.model_copy(update={name: getattr(params, name).model_copy(update=values)})


def _set(content: dict, values: Mapping[str, object]) -> None:
    for key, value in values.items():
        *sections, name = key.split(".")
        node = content
        for section in sections:
            node = node[section]
        node[name] = value


def run_of(methods: Mapping[str, Sequence[str]], rig: bool = True) -> dict[str, dict]:
    """The section `run` of params.yaml.

    Args:
        methods: By recordings, each called BAND or BAND-RECORDING; the first is `run.main`.
        rig: Whether the virtual rig makes the recordings.
    """
    named = {name: method.search for name, method in load(DEFAULTS).methods.items()}
    recordings = {}
    for key in methods:
        band, _, recording = key.partition("-")
        recordings[key] = {"band": band, "recording": recording or PLAIN}
    kinds: dict[str, dict] = {kind: {} for kind in UNIONS["pairs"]}
    for key, names in methods.items():
        for name in names:
            search = named[name]
            kind = search if search in kinds else "search"
            code = {"search": search} if kind == "search" else {}
            kinds[kind][f"{key}-{name}"] = recordings[key] | {"method": name} | code
    unions = {
        union: {key: pair for kind in members for key, pair in kinds[kind].items()}
        for union, members in UNIONS.items()
    }
    bands = list(dict.fromkeys(recording["band"] for recording in recordings.values()))
    section = {
        "floors": bands if rig else [],
        "main": next(iter(methods.values()))[0],
        "rig": recordings if rig else {},
        "recordings": recordings,
    }
    return {"run": copy.deepcopy(section | kinds | unions)}


def environment(**more: str) -> dict[str, str]:
    """Ours, with this Python and this project first, one thread a process, and `more`."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ours = {"PATH": path, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    return {**os.environ, **ours, **more}


class ProjectCopy:
    """A folder in which commands run, with `more` in their environment.

    Attributes:
        limit: That a command may take [s]; None: any time.
    """

    limit: float | None = 1200.0

    def __init__(self, folder: Path, **more: str) -> None:
        self.folder = folder
        site = str(folder.parent / f"site-{folder.name}")
        self.environment = environment(DVC_SITE_CACHE_DIR=site, **more)

    def __call__(self, *command: str) -> str:
        """What a command prints. Raises AssertionError where it fails."""
        options = {"cwd": self.folder, "env": self.environment, "capture_output": True}
        done = subprocess.run(command, text=True, timeout=self.limit, **options)
        assert done.returncode == 0, f"{' '.join(command)}:\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def dvc(self, *arguments: str) -> set[str]:
        """Run DVC; the stages that really ran."""
        return set(re.findall(r"^Running stage '(.+)':$", self("dvc", *arguments), re.MULTILINE))

    def set(self, values: Mapping[str, object]) -> None:
        """Set values in params.yaml, by keys with dots."""
        yaml, path = YAML(), self.folder / "params.yaml"
        content = yaml.load(path)
        _set(content, values)
        yaml.dump(content, path)

    def commit(self) -> None:
        """Commit all files, in a Git repository of the folder's own."""
        if not (self.folder / ".git").is_dir():
            self("git", "init", "-q")
            self("git", "config", "user.name", "Test")
            self("git", "config", "user.email", "test@example.org")
        self("git", "add", "--all")
        self("git", "commit", "-q", "-m", "state")


class MarkedRun:
    """Commands in a folder, whose processes all bear a mark in their environment."""

    def __init__(self, folder: Path, **more: str) -> None:
        self.folder, self.mark = folder, uuid.uuid4().hex
        self.log = folder.parent / "said.txt"
        self.environment = environment(**{MARK: self.mark}, **more)

    def start(self, *command: str) -> subprocess.Popen:
        """Start a command in a session of its own; its lines, errors among them, go to `log`."""
        with self.log.open("w") as message:
            return subprocess.Popen(
                command, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                stdout=message, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip

    @property
    def message(self) -> str:
        return self.log.read_text(errors="replace")

    def alive(self) -> dict[psutil.Process, str]:
        """Command lines of what runs; zombies, which wait for a parent, apart."""
        found = {}
        for process in psutil.process_iter():
            with suppress(psutil.NoSuchProcess, psutil.AccessDenied):
                zombie = process.status() == psutil.STATUS_ZOMBIE
                if not zombie and process.environ().get(MARK) == self.mark:
                    found[process] = " ".join(process.cmdline())
        return found

    def named(self, word: str) -> list[str]:
        """Command lines with a word in them."""
        return [line for line in self.alive().values() if word in line]

    def left(self) -> list[str]:
        """Command lines of what still lives after PROMPT; it is killed."""
        wait(lambda: not self.alive(), PROMPT)
        left = self.alive()
        for process in left:
            with suppress(psutil.NoSuchProcess):
                process.kill()
        return [*left.values()]


def wait(happens: Callable[[], Value], seconds: float) -> Value:
    """What `happens` returns once that is true, or after so long."""
    latest = time.monotonic() + seconds
    while not (value := happens()) and time.monotonic() < latest:
        time.sleep(0.05)
    return value
