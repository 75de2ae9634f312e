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
from ruamel.yaml import YAML

from sling2sim2real.base.disk import with_disk
from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.machine import cores

DVC = (sys.executable, "-P", "-m", "dvc", "--wait-for-lock")
GRACE = 15.0  # s that interrupted stages and DVC have to end
# What DVC says of itself, beside which stage it runs.
CHATTER = re.compile("> |Updating|Generating|To track|\tgit add|To enable|\tdvc|Use `dvc|Data and")
FAILED = re.compile("ERROR: (?:failed to reproduce '.+?': )?(?:failed to run: .*with (-?[0-9]+))?")

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


class StageFailed(UserError):
    """A stage failed; the message is its name and its own clear line."""


def stale(root: Path, targets: Sequence[str] = ()) -> networkx.DiGraph:
    """The graph of stages that are stale or follow from such, from producers to consumers.

    Args:
        root: The working copy.
        targets: Stages, or steps for all their stages: these alone and what leads to them.

    Returns:
        Its nodes are names as DVC has them; `gpu` says of each whether it computes where
        SLING_DEVICE says (`meta: {gpu: true}` in dvc.yaml).

    Raises:
        UserError: A target is no stage, DVC cannot read the project, or another DVC is at work.
    """
    status = json.loads(_said(root, "status", "--json"))
    if not (status or targets):
        return networkx.DiGraph()
    graph = graph_of(root)
    first = [name for name in graph if name in status]
    names = {*first}.union(*(networkx.descendants(graph, name) for name in first))
    if targets:
        ends = {name for target in targets for name in named(target, graph)}
        names &= ends.union(*(networkx.ancestors(graph, name) for name in ends))
    return graph.subgraph(names)


def graph_of(root: Path) -> networkx.DiGraph:
    """All stages, as `stale` has them. Raises UserError."""
    dot = _said(root, "dag", "--dot")
    graph = networkx.DiGraph(re.findall('"(.+)" -> "(.+)";', dot))
    graph.add_nodes_from(re.findall('^"([^"]+)";$', dot, re.MULTILINE))
    graph.remove_nodes_from([name for name in graph if name.endswith(".dvc")])  # of `dvc add`
    steps = YAML(typ="safe").load((root / "dvc.yaml").read_text(encoding="utf-8"))["stages"]
    for name, data in graph.nodes(data=True):
        step = steps[name.partition("@")[0]]
        data["gpu"] = step.get("do", step).get("meta", {}).get("gpu", False)
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


def environment(threads: int | None = None) -> dict[str, str]:
    """What a stage gets: all that is exported here, this Python first, and `threads` threads."""
    share = str(threads or cores())
    return os.environ | {
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
        "SHELL": "/bin/sh",  # by which DVC starts stages: a C shell would read its settings
        "PYTHONUNBUFFERED": "1",  # lines as they come
        "SLING_WORKERS": share,
        "OMP_NUM_THREADS": share,
        "SLING_FLOW": str(os.getpid()),  # a stage ends where we are killed, see stages/start.py
    }


def repro(
    root: Path,
    target: str,
    on_line: Callable[[str], None],
    options: Sequence[str] = (),
    env: Mapping[str, str] | None = None,
) -> list[str]:
    """Run `dvc --wait-for-lock repro TARGET`, which runs what is stale of it.

    Args:
        root: The working copy.
        target: A stage.
        on_line: Called with each line of the stages, and DVC's that one begins.
        options: More of DVC's: `-s` for the stage alone.
        env: The whole environment; None: `environment` with all cores.

    Returns:
        All that was said, in lines.

    Raises:
        StageFailed: With the name of the stage that failed, and why.
    """
    if _ending.is_set():
        raise StageFailed(f"{target}: interrupted")
    begin, output = 0, []
    command = [*DVC, "repro", *options, target]
    process = subprocess.Popen(command, cwd=root, env=env or environment(), **PIPED)
    _running.add(process)
    try:
        for line in map(str.rstrip, process.stdout or ()):
            output.append(line)
            if line.startswith("Running stage '"):
                begin = len(output)
            if line and not CHATTER.match(line) and not line.startswith("ERROR: failed to repro"):
                on_line(line)
        process.wait()
    finally:
        _end([process])
        _running.discard(process)
    if process.returncode:
        name = [target, *re.findall("failed to reproduce '(.+?)'", "\n".join(output))][-1]
        raise StageFailed(with_disk(f"{name}: {cause(output[begin:], process.returncode)}", root))
    return output


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
        output: What it and its last stage said, in lines.
        status: Its exit status.
    """
    said = [line for line in output if line and not CHATTER.match(line)]
    own = [line for line in said if not line.startswith(("ERROR: ", "Running stage '"))]
    errors = [line[7:] for line in own if line.startswith("error: ")]
    if any(re.search(r"dvc\.lock' (is invalid|validation failed)", line) for line in own):
        return "dvc.lock was cut off while it was written; `git checkout dvc.lock` mends it"
    for number, line in enumerate(said):
        if failed := FAILED.match(line):
            if failed[1] is None:  # DVC itself, before or after the stage's command
                return one_line(" ".join([line[failed.end() :], *said[number + 1 : number + 2]]))
            status = int(failed[1])
    if errors:
        return errors[-1]
    if status < 0 or 128 < status < 192:  # as Python has it, and as a shell
        return f"was killed by signal {abs(status) % 128}"
    return f"{own[-1] if own else 'said nothing'} (exit status {status})"
