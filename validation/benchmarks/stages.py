"""What each step of a run takes of the processor: interpreter, imports, DVC and the work itself.

    python -m validation.benchmarks.stages --project FOLDER [--steps record theta] [--as before]

runs one stage of each step anew, in a copy of a project with the data of a whole run (it is FOLDER
that changes) and by the Python that runs this. It writes reports/benchmarks/stages.json: `after`,
the code as it is, or `before`, another state of it to compare with. CPU seconds, of all processes:

    interpreter  an empty one
    imports      of all modules that the stage has imported when it ends, wherever in the code
    work         of the stage, less both
    dvc          of `dvc repro` of the stage when it has nothing to do: start, graph, digests

and `again_s`, of `dvc repro` and `sling flow` where all is fresh. `heavy` names big libraries that
the stage has loaded.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

from ruamel.yaml import YAML

from pipeline.base import errors
from pipeline.base.environment import environment
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.machine import commit

REPORT = Path("reports/benchmarks/stages.json")
HEAVY = "torch open3d warp cv2 matplotlib pandas sklearn botorch numba onnxruntime scipy".split()
IMPORT = re.compile(r"^import time:\s+\d+ \|\s+\d+ \|\s+([\w.]+)$", re.MULTILINE)
DVC = ("-m", "dvc")
QUICK = "app/flow/dvc_process.py"  # how `sling flow` calls DVC, where it has it
IMPORTS = """
import importlib, sys
for name in sys.stdin.read().split():
    try:
        importlib.import_module(name)
    except Exception:
        pass
"""


@dataclass(frozen=True)
class Project:
    """A copy of a project with its data, whose stages may run."""

    folder: Path

    def cpu(
        self, words: Sequence[str], given: str = "", **exported: str
    ) -> tuple[float, subprocess.CompletedProcess]:
        """CPU seconds of a command there and of its children. Raises UserError where it fails."""
        before = getrusage(RUSAGE_CHILDREN)
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        surroundings = {**os.environ, "PATH": path, "PYTHONPATH": ".", **exported}
        done = subprocess.run(
            words, cwd=self.folder, env=surroundings, input=given, capture_output=True, text=True
        )
        after = getrusage(RUSAGE_CHILDREN)
        if done.returncode:
            message = (done.stderr or done.stdout).strip().splitlines() or [""]
            raise UserError(f"{self.folder}: {' '.join(words)}: {errors.one_line(message[-1])}")
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done

    def python(self, *words: str, given: str = "") -> float:
        return self.cpu([sys.executable, *words], given)[0]

    def dvc(self, *words: str) -> float:
        quick = self.folder / QUICK
        return self.python(*(("-P", str(quick)) if quick.is_file() else DVC), *words)

    def steps(self) -> dict[str, tuple[str, str]]:
        """First stage of each step and the command of that, as dvc.lock has them."""
        text = (self.folder / "dvc.lock").read_text(encoding="utf-8")
        first_stages: dict[str, tuple[str, str]] = {}
        for name, entry in YAML(typ="safe").load(text)["stages"].items():
            first_stages.setdefault(name.partition("@")[0], (name, entry["cmd"]))
        return first_stages


def profile(project: Project, steps: Sequence[str]) -> dict[str, dict]:
    """Parts of each step's time; its stage runs once."""
    stages, interpreter, profiles = project.steps(), project.python("-c", "pass"), {}
    if unknown := sorted({*steps} - stages.keys()):
        raise UserError(f"--steps {' '.join(unknown)}: there are {', '.join(stages)}")
    for step in steps or stages:
        name, command = stages[step]
        words = ["/bin/sh", "-c", command]
        _, message = project.cpu(words, PYTHONPROFILEIMPORTTIME="1")  # which takes its own time
        modules = list(dict.fromkeys(IMPORT.findall(message.stderr)))
        whole, imports = (
            project.cpu(words)[0],
            project.python("-c", IMPORTS, given=" ".join(modules)),
        )
        profiles[step] = {
            "stage": name,
            "interpreter_s": round(interpreter, 2),
            "imports_s": round(max(imports - interpreter, 0.0), 2),
            "work_s": round(max(whole - max(imports, interpreter), 0.0), 2),
            "dvc_s": round(project.dvc("repro", "-s", name), 2),
            "heavy": [module for module in HEAVY if module in modules],
        }
        print(f"{step}: {profiles[step]}", file=sys.stderr, flush=True)
    return profiles


def again(project: Project) -> dict[str, float]:
    """CPU seconds where nothing is stale; the first time, DVC reads all files once."""
    project.python(*DVC, "status")
    flow = ("-c", "from app.cli import main; main()", "flow")
    return {
        "dvc repro": round(project.python(*DVC, "repro"), 2),
        "sling flow": round(project.python(*flow), 2),
    }


def updated(path: Path, side: str, figures: Mapping, command: str) -> dict:
    """The report with what was found for one side; what the other one has stays."""
    before = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    sides = {name: before[name] for name in ("before", "after") if name in before}
    return environment("cpu", command) | sides | {side: {**sides.get(side, {}), **figures}}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--project", type=Path, required=True, help="a copy; its stages run")
    parser.add_argument("--steps", nargs="*", default=[], help="default: all")
    parser.add_argument("--as", dest="side", choices=("before", "after"), default="after")
    parser.add_argument("--idle", action="store_true", help="only where all is fresh")
    arguments = parser.parse_args()
    project = Project(arguments.project.resolve())
    if not (project.folder / "dvc.lock").is_file():
        raise UserError(f"{arguments.project}: no dvc.lock here; give a copy with a run's data")
    figures: dict = {"commit": commit(project.folder)}
    if not arguments.steps:  # else the other stages may be stale
        figures["again_s"] = again(project)
    if not arguments.idle:
        figures["steps"] = profile(project, arguments.steps)
    command = f"python -m validation.benchmarks.stages --project FOLDER --as {arguments.side}"
    write_json(REPORT, updated(REPORT, arguments.side, figures, command))


if __name__ == "__main__":
    errors.run(main)
