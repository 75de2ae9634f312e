"""How long set-up, a run, a fit and the tests take, and their memory and disk.

    python -m validation.benchmarks.times --folder FOLDER --recording my.mcap --mass 0.0408

clones the commit that is checked out here into FOLDER, with caches of its own, so that everything
is downloaded and compiled, and measures each step there. What succeeded is not measured again: the
same command goes on where it was killed. It writes reports/benchmarks/times.json.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sling2sim2real.base import errors
from sling2sim2real.base.code import ROOT
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from validation.benchmarks.timing import disk, measured
from validation.reports import row, write_report

REPORT = Path("reports/benchmarks/times.json")
BAND = "timed"  # of the recording
DEMO = (  # `make demo` in a clone of its own, where nothing has run
    "clone=$PWD && rm -rf ../demo && git clone -q . ../demo && cd ../demo"
    ' && ln -s "$clone/.venv" .venv && make demo'
)
CHANGES = ("PYTHONPATH", "VIRTUAL_ENV", "UV_CACHE_DIR", "PIP_CACHE_DIR", "WARP_CACHE_PATH")


@dataclass(frozen=True)
class MeasuredStep:
    """A command in the clone.

    Attributes:
        name: Of its files in FOLDER.
        what: In the table.
        command: Its words.
        says: A pattern that its output has where it did what it is to be timed for.
        makes: What the table counts as its disk, from the clone's folder.
    """

    name: str
    what: str
    command: tuple[str, ...]
    says: str = ""
    makes: tuple[str, ...] = ()


def steps(recording: Path, mass: float) -> list[MeasuredStep]:
    """All steps, in their order; each needs those before it."""
    sling, mine, draw = ".venv/bin/sling", f"bands/{BAND}", "--draw=-0.30,-0.15"
    aim = (sling, "aim", "reports/bands/band1", "--target", "1.925", "--force")
    observe = (sling, "observe", mine, draw, "--landing", "1.85")
    fit = (sling, "fit", str(recording.resolve()), "--mass", f"{mass:g}", "--name", BAND)
    made = ("data", ".dvc/cache")
    rows = [
        ("setup", "`make setup`, nothing downloaded yet", ("make", "setup"), "", (".venv",)),
        ("run", "`make run`, after set-up", ("make", "run"), "[1-9][0-9]* ran", made),
        ("again", "`sling flow`, nothing stale", (sling, "flow")),
        ("aim", "`sling aim`", aim),
        ("launch", "`sling launch`", (sling, "launch", "reports/bands/band1", draw)),
        ("demo", "`make demo`, after set-up", ("sh", "-c", DEMO)),
        ("test", "`make test`, after set-up", ("make", "test"), "[0-9] passed"),
        ("test-all", "`make test-all`", ("make", "test-all"), "[0-9] passed"),
        ("check", "`sling check`", (sling, "check", str(recording.resolve()))),
        ("fit", "`sling fit`", fit),
        ("observe", "`sling observe`", observe),
    ]
    return [MeasuredStep(*cells) for cells in rows]


def cloned(folder: Path, root: Path = ROOT) -> Path:
    """A clone of what is checked out in `root`; one that is there stays."""
    clone = folder / "project"
    if not clone.is_dir():
        words = ["git", "clone", "--quiet", "--no-hardlinks", str(root), str(clone)]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            raise UserError(f"{root}: cannot be cloned: {errors.one_line(done.stderr)}")
    return clone


def surroundings(folder: Path) -> dict[str, str]:
    """The environment of a step: caches in `folder`, no Python of ours and no setting of SLING_."""
    ours = {name: value for name, value in os.environ.items() if not name.startswith("SLING_")}
    for name in CHANGES:
        ours.pop(name, None)
    if sys.prefix != sys.base_prefix:
        venv_bin = str(Path(sys.prefix, "bin"))
        ours["PATH"] = os.pathsep.join(
            directory for directory in ours["PATH"].split(os.pathsep) if directory != venv_bin
        )
    cache = folder / "cache"
    return {**ours, "XDG_CACHE_HOME": str(cache), "DVC_SITE_CACHE_DIR": str(cache / "dvc")}


def perform(step: MeasuredStep, folder: Path) -> dict:
    """Measure a step, unless its file in `folder` has it. Raises UserError where it fails."""
    result_file, log = folder / f"{step.name}.json", folder / f"{step.name}.log"
    if result_file.is_file():
        return json.loads(result_file.read_text(encoding="utf-8"))
    clone = folder / "project"
    result = measured(step.command, clone, surroundings(folder), log)
    message = log.read_text(encoding="utf-8", errors="replace")
    if result["status"] or not re.search(step.says, message):
        last = errors.one_line((message.strip().splitlines() or [""])[-1])
        raise UserError(f"{step.name}: status {result['status']}: {last}; all of it: {log}")
    result["disk_bytes"] = {name: disk(clone / name) for name in step.makes}
    result["what"] = step.what
    write_json(result_file, result)
    return result


def table(report: dict) -> list[str]:
    """The table of docs/times.md, and how it was measured."""
    share = max(result["others_share"] for result in report["steps"])
    return [
        f"Measured on {report['cores']} cores of an {report['device_name']}, no GPU, of which"
        f" other programs took {100 * share:.0f} % at most, by",
        f"`{report['command']}`:",
        "",
        row("what", "time", "CPU time", "memory, at most", "on the disk afterwards"),
        "|---|---:|---:|---:|---|",
        *map(_row, report["steps"]),
    ]


def _row(result: dict) -> str:
    parts = [f"`{name}` {_size(size)}" for name, size in sorted(result["disk_bytes"].items())]
    durations = _duration(result["seconds"]), _duration(result["cpu_seconds"])
    return row(result["what"], *durations, _size(result["peak_memory_bytes"]), ", ".join(parts))


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds >= 600 else f"{seconds / 60:.1f} min"


def _size(count: float) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e8 else f"{count / 1e6:.0f} MB"


def times(todo: Sequence[MeasuredStep], folder: Path, root: Path, arguments: str) -> dict:
    """Measure the steps and write the report of `root`; what it says. Raises UserError."""
    folder.mkdir(parents=True, exist_ok=True)
    cloned(folder, root)
    done = []
    for step in todo:
        print(f"{step.name}: {' '.join(step.command)}", file=sys.stderr, flush=True)
        done.append(perform(step, folder))
    return write_report(root / REPORT, {"steps": done}, arguments)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--folder", type=Path, required=True, help="of the clone and what is kept")
    parser.add_argument("--recording", type=Path, required=True, help="MCAP of a band")
    parser.add_argument("--mass", type=float, default=0.0408, help="of that band, in kg")
    arguments = parser.parse_args()
    if not arguments.recording.is_file():
        raise UserError(f"{arguments.recording}: no such file")
    words = f"--folder FOLDER --recording {arguments.recording.name} --mass {arguments.mass:g}"
    todo = steps(arguments.recording, arguments.mass)
    times(todo, arguments.folder.resolve(), ROOT, words)


if __name__ == "__main__":
    errors.run(main)
