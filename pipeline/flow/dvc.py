"""DVC by its command line: what is stale, and one command that runs it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import networkx
import psutil

from sling2sim2real.base.disk import with_disk
from sling2sim2real.base.errors import UserError, one_line

# Without looking for garbage, which is a sixth of a command: it parses dvc.lock and ends.
MAIN = "import gc, sys; gc.disable(); from dvc.cli import main; sys.exit(main(sys.argv[1:]))"
DVC = (sys.executable, "-P", "-c", MAIN, "--wait-for-lock")
GRACE = 15.0  # s that interrupted stages and DVC have to end
BEGINS = "Running stage"
OF_DVC = re.compile(  # what it says of itself
    f"{BEGINS}|> |Updating|Generating|To track|\tgit add|To enable|\tdvc|Use `dvc|Data and|ERROR:"
)

PIPED: dict[str, Any] = {
    "stdin": subprocess.DEVNULL,
    "stdout": subprocess.PIPE,
    "stderr": subprocess.STDOUT,
    "encoding": "utf-8",
    "errors": "replace",
    "start_new_session": True,  # a terminal's Ctrl-C is for us alone
}

_running: set[subprocess.Popen] = set()
_ending = threading.Event()


def stale(root: Path, targets: Sequence[str] = ()) -> networkx.DiGraph:
    """The graph of stages that are stale or follow from such, from producers to consumers.

    Args:
        root: The working copy.
        targets: Stages, or steps for all their stages: these alone and what leads to them.

    Returns:
        Its nodes are names as DVC has them.

    Raises:
        UserError: A target is no stage, DVC cannot read the project, or another DVC is at work.
    """
    status = json.loads(_said(root, "status", "--json"))
    if not (status or targets):
        return networkx.DiGraph()
    graph = graph_of(root)
    first = [name for name in graph if name in status]
    names = {*first}.union(*(networkx.descendants(graph, name) for name in first))
    ends = {name for target in targets for name in named(target, graph)} or {*graph}
    return graph.subgraph(names & ends.union(*(networkx.ancestors(graph, name) for name in ends)))


def graph_of(root: Path) -> networkx.DiGraph:
    """All stages, as `stale` has them. Raises UserError."""
    dot = _said(root, "dag", "--dot")
    graph = networkx.DiGraph(re.findall('"(.+)" -> "(.+)";', dot))
    graph.add_nodes_from(re.findall('^"([^"]+)";$', dot, re.MULTILINE))
    graph.remove_nodes_from([name for name in graph if name.endswith(".dvc")])  # of `dvc add`
    return graph


def named(target: str, stages: Iterable[str]) -> set[str]:
    """The stages that a target means: one, or all of a step. Raises UserError."""
    if found := {name for name in stages if target in (name, name.partition("@")[0])}:
        return found
    raise UserError(f"{target}: no stage of dvc.yaml; `dvc stage list` has all")


def _said(root: Path, *arguments: str) -> str:
    """What a DVC command prints. Raises UserError."""
    done = subprocess.run([*DVC, *arguments], cwd=root, capture_output=True, encoding="utf-8")
    if done.returncode:
        raise UserError(f"dvc {arguments[0]}: {cause(done.stderr.splitlines(), done.returncode)}")
    return done.stdout


def environment(threads: int) -> dict[str, str]:
    """What a stage gets: all that is exported here, this Python first, and `threads` threads."""
    return os.environ | {
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
        "SHELL": "/bin/sh",  # by which DVC starts stages: a C shell would read its settings
        "PYTHONUNBUFFERED": "1",  # lines as they come
        "SLING_WORKERS": str(threads),
        "OMP_NUM_THREADS": str(threads),
        "SLING_FLOW": str(os.getpid()),  # a stage ends where we are killed, see stages/start.py
    }


def repro(root: Path, stage: str, env: Mapping[str, str], on_line: Callable[[str], None]) -> None:
    """Run `dvc --wait-for-lock repro -s STAGE`, which runs a stage if it is stale.

    Args:
        root: The working copy.
        stage: Its producers are fresh.
        env: The whole environment, from `environment`.
        on_line: Called with each line of the stage, and DVC's of where it begins or need not run.

    Raises:
        UserError: Why it failed.
    """
    if _ending.is_set():
        raise UserError("interrupted")
    process = subprocess.Popen([*DVC, "repro", "-s", stage], cwd=root, env=env, **PIPED)
    _running.add(process)
    output = []
    try:
        for line in map(str.rstrip, process.stdout or ()):
            output.append(line)
            if line.startswith(BEGINS) or (line and not OF_DVC.match(line)):
                on_line(line)
        process.wait()
    finally:
        _end([process])
        _running.discard(process)
    if process.returncode:
        raise UserError(with_disk(cause(output, process.returncode), root))


def end_all() -> None:
    """End all stages that run, in whatever threads; none begins from now on."""
    _ending.set()
    _end([*_running])


def _end(children: Sequence[subprocess.Popen]) -> None:
    """Interrupt stages, so that DVC ends itself, which may be writing dvc.lock; then kill."""
    deadline = time.monotonic() + GRACE
    while time.monotonic() < deadline and (alive := [c for c in children if c.poll() is None]):
        for child in alive:
            with suppress(psutil.NoSuchProcess):
                for process in psutil.Process(child.pid).children(recursive=True):
                    process.send_signal(signal.SIGINT)
        time.sleep(0.5)
    for child in children:
        with suppress(ProcessLookupError):  # it, and what a stage has left behind
            os.killpg(child.pid, signal.SIGKILL)
        child.wait()


def cause(output: Sequence[str], status: int) -> str:
    """Why a DVC command failed: the stage's line of error, its signal or exit status, or DVC's.

    Args:
        output: What it and its stage said, in lines.
        status: Its exit status.
    """
    text = "\n".join(output)
    if re.search(r"dvc\.lock' (is invalid|validation failed)", text):
        return "dvc.lock was cut off while it was written; `git checkout dvc.lock` mends it"
    if of_stage := re.search("^ERROR: .*failed to run: .*with (-?[0-9]+)$", text, re.MULTILINE):
        status = int(of_stage[1])
    elif own := re.search("^ERROR: (?:failed to reproduce '.+?': )?((?:.+\n?){1,2})", text, re.M):
        return one_line(own[1])  # before or after the stage's command
    said = [line for line in output if line and not OF_DVC.match(line)]
    if errors := [line[7:] for line in said if line.startswith("error: ")]:
        return errors[-1]
    if status < 0 or 128 < status < 192:  # as Python has it, and as a shell
        return f"was killed by signal {abs(status) % 128}"
    return f"{said[-1] if said else 'said nothing'} (exit status {status})"
