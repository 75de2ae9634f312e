"""How long set-up, a run, a fit and the tests take, and their memory and disk.

    python -m validation.benchmarks.times --folder FOLDER --recording my.mcap --mass 0.0408

clones the commit that is checked out here into FOLDER, with caches of its own, so that everything
is downloaded and compiled, and measures each step there. What succeeded is not measured again: the
same command goes on where it was killed. It writes reports/benchmarks/times.json, its table into
docs/times.md, and the seconds by which `sling fit` counts down into app/fit/seconds.json.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.base import errors
from pipeline.base.code import ROOT, digests
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.fingerprint import fingerprint
from pipeline.base.machine import commit
from validation.benchmarks.timing import disk, measured
from validation.campaigns.runner import read
from validation.marked import fill, marks
from validation.reports import write_report

REPORT, PAGE = Path("reports/benchmarks/times.json"), Path("docs/times.md")
SECONDS = Path("app/fit/seconds.json")
BEGIN, END = marks("times")
BAND = "timed"  # of the recording
DEMO = (  # `make demo` in a clone of its own, where nothing has run
    "clone=$PWD && rm -rf ../demo && git clone -q . ../demo && cd ../demo"
    ' && PATH="$clone/.venv/bin:$PATH" sling fit --name band1_dip'
)
CHANGES = ("PYTHONPATH", "VIRTUAL_ENV", "UV_CACHE_DIR", "PIP_CACHE_DIR", "WARP_CACHE_PATH")
STAGE = re.compile(r"^([a-z]+)(?:@[\w-]+)? \| done \((?:(\d+) min )?([\d.]+) s\)$", re.MULTILINE)
GROUP = re.compile("^(ablation|own|dip)_", re.MULTILINE)
STAGES = "record episode mounting clamps evidence history clusters cma density de bo adam search"
STAGES = (STAGES + " theta policy launches trials floor card report").split()  # order of columns


@dataclass(frozen=True)
class MeasuredStep:
    """A command in the clone.

    Attributes:
        name: Of its files in FOLDER.
        what: In the table.
        command: Its words.
        says: A pattern that its output has where it did what it is to be timed for.
        makes: What the table counts as its disk, from the clone's folder.
        needs: The step that must have succeeded.
    """

    name: str
    what: str
    command: tuple[str, ...]
    says: str = ""
    makes: tuple[str, ...] = ()
    needs: str = ""


def steps(recording: Path | None, mass: float) -> list[MeasuredStep]:
    """All steps, in their order; a fit, which adds a band to params.yaml, comes last."""
    sling, mine, draw = ".venv/bin/sling", ("--band", "band1"), "--draw=-0.30,-0.15"
    aim = (sling, "aim", *mine, "--target", "1.925", "--force")
    observe = (sling, "observe", *mine, draw, "--landing", "1.85")
    file = str(recording.resolve()) if recording else "FILE.mcap"
    mass = ("--mass", f"{mass:g}")
    made = ("data", ".dvc/cache", "logs")
    rows = [
        ("setup", "`make setup`, nothing downloaded yet", ("make", "setup"), "", (".venv",)),
        ("run", "`make run`, after set-up", ("make", "run"), "[1-9][0-9]* ran", made, "setup"),
        ("again", "`sling flow`, nothing stale", (sling, "flow"), "are fresh", (), "run"),
        ("aim", "`sling aim`", aim, "", (), "run"),
        ("launch", "`sling launch`", (sling, "launch", *mine, draw), "", (), "run"),
        ("observe", "`sling observe`", observe, "", (), "run"),
        ("demo", "`make demo`, after set-up", ("sh", "-c", DEMO), "", (), "setup"),
        ("test", "`make test`, after set-up", ("make", "test"), "[0-9] passed", (), "setup"),
        ("check", "`sling check`", (sling, "check", file), "", (), "setup"),
        ("fit", "`sling fit`", (sling, "fit", file, *mass, "--name", BAND), "", (), "setup"),
        ("refit", "`sling fit`, nothing stale", (sling, "fit", "--name", BAND), "", (), "fit"),
    ]
    return [MeasuredStep(*row) for row in rows]


NEED_RECORDING = ("check", "fit", "refit")


def cloned(folder: Path, root: Path = ROOT) -> Path:
    """A clone of what is checked out in `root`; one that is there stays."""
    clone = folder / "project"
    if not clone.is_dir():
        temporary = folder / "project.tmp"
        shutil.rmtree(temporary, ignore_errors=True)
        words = ["git", "clone", "--quiet", "--no-hardlinks", str(root), str(temporary)]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            raise UserError(f"{root}: cannot be cloned: {errors.one_line(done.stderr)}")
        write_json(folder / "clone.json", {"commit": commit(temporary)})
        temporary.rename(clone)
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


def seconds_of_stages(log: str) -> dict[str, dict]:
    """Seconds of the stages that a flow ran, by their script: how many, the median, the longest."""
    durations: dict[str, list[float]] = {}
    for step, minutes, seconds in STAGE.findall(GROUP.sub("", log)):
        durations.setdefault(step, []).append(60 * int(minutes or 0) + float(seconds))
    return {
        step: {
            "count": len(seconds_each),
            "median_s": statistics.median(seconds_each),
            "most_s": max(seconds_each),
        }
        for step, seconds_each in durations.items()
    }


def seconds_of_fit(folder: Path) -> dict[str, int]:
    """Seconds of the steps of the fit in a clone, by the log that it left there."""
    durations: dict[str, int] = {}
    for path in sorted((folder / "logs" / "runs").glob("*.jsonl")):
        events = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
        if events[0]["command"] != "sling fit":
            continue
        begun = {row["stage"]: row["at"] for row in events if row["what"] == "stage"}
        for event in events:
            if event["what"] == "ended" and event.get("stage") in begun:
                step = GROUP.sub("", event["stage"].partition("@")[0])
                durations[step] = max(round(event["at"] - begun[event["stage"]]), 1)
    return durations


def perform(step: MeasuredStep, done: dict[str, dict], folder: Path) -> dict:
    """What a step's file in `folder` says; measured now where it is not there or failed."""
    result_file, log = folder / f"{step.name}.json", folder / f"{step.name}.log"
    if result_file.is_file() and (result := read(result_file))["ok"]:
        return result
    if step.needs and not done[step.needs].get("ok"):
        return {"ok": False, "why": f"needs {step.needs}"}
    clone = folder / "project"
    result = measured(step.command, clone, surroundings(folder), log)
    message = log.read_text(encoding="utf-8", errors="replace")
    result["ok"] = result["status"] == 0 and bool(re.search(step.says, message))
    if not result["ok"]:
        last = (message.strip().splitlines() or [""])[-1]
        result["why"] = f"status {result['status']}: {errors.one_line(last)[:200]}"
    result["disk_bytes"] = {name: disk(clone / name) for name in step.makes}
    if stages := seconds_of_stages(message):
        result["stages"] = stages
    write_json(result_file, result)
    return result


def table(report: dict) -> str:
    """The block of docs/times.md."""
    done = {name: report["steps"][name] for name in report["order"]}
    share = max((result.get("others_share", 0) for result in done.values()), default=0)
    rows = [
        "| what | time | CPU time | memory, at most | on the disk afterwards |",
        "|---|---:|---:|---:|---|",
    ]
    rows += [_row(result) for result in done.values()]
    ran = done.get("run", {}).get("stages", {})
    took = {name: ran[name] for name in sorted(ran, key=[*STAGES, *ran].index)}
    lines = [
        BEGIN.rstrip(),
        f"Measured on {report['cores']} cores of an {report['device_name']}, no GPU, of which other"
        f" programs took {100 * share:.0f} % at most, by",
        f"`{report['command']}`:",
        "",
        *rows,
    ]
    if took:
        lines += [
            "",
            "Of `make run`, seconds per stage (median), while another runs beside it:",
            "",
            f"| stage | {' | '.join(f'`{name}`' for name in took)} |",
            f"|---|{'---:|' * len(took)}",
            f"| s | {' | '.join(format(stage['median_s'], '.0f') for stage in took.values())} |",
            f"| how many | {' | '.join(str(stage['count']) for stage in took.values())} |",
        ]
    return "\n".join([*lines, END])


def _row(result: dict) -> str:
    if not result["ok"]:
        return f"| {result['what']} | {result.get('skipped') or 'failed: ' + result['why']} | | | |"
    parts = [f"`{name}` {_size(size)}" for name, size in sorted(result["disk_bytes"].items())]
    cells = [
        result["what"],
        _duration(result["seconds"]),
        _duration(result["cpu_seconds"]),
        _size(result["peak_memory_bytes"]),
        ", ".join(parts),
    ]
    return f"| {' | '.join(cells)} |"


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds >= 600 else f"{seconds / 60:.1f} min"


def _size(count: float) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e8 else f"{count / 1e6:.0f} MB"


def times(
    todo: Sequence[MeasuredStep], folder: Path, root: Path, skipped: dict[str, str], arguments: str
) -> dict:
    """Measure the steps and write report and page of `root`; what the report says. UserError."""
    folder.mkdir(parents=True, exist_ok=True)
    clone, done = cloned(folder, root), {}
    for step in todo:
        if step.name in skipped:
            done[step.name] = {"ok": False, "skipped": skipped[step.name]}
        else:
            print(f"{step.name}: {' '.join(step.command)}", file=sys.stderr, flush=True)
            done[step.name] = perform(step, done, folder)
            done[step.name].pop("status", None)
        done[step.name] |= {"what": step.what}
        result = done[step.name]
        summary = result.get("why") or result.get("skipped") or f"{result['seconds']:.0f} s"
        print(f"{step.name}: {summary}", file=sys.stderr, flush=True)
    scripts = [clone / "app/cli.py", *sorted((clone / "stages").glob("[a-z]*.py"))]
    content = {
        "about": "Each step in one fresh clone with a new .venv and caches of its own. Memory is"
        " the peak of the process tree (PSS, looked at once a second); others_share is the share of"
        " the cores that other programs took meanwhile. `sling check` and `sling fit` are of one"
        " recording that was not made here.",
        "commit": read(folder / "clone.json")["commit"],
        "simulator": fingerprint(clone / "pipeline/simulator")[:12],
        "code": digests(*(script for script in scripts if script.is_file()), root=clone),
        "steps": done,
        "order": [step.name for step in todo],
        "met": all(outcome["ok"] or "skipped" in outcome for outcome in done.values()),
    }
    report = write_report(root / REPORT, content, arguments)
    fits = seconds_of_fit(folder / "demo") | seconds_of_fit(clone)  # a recording's, and a demo's
    if fits:
        write_json(root / SECONDS, fits)
    fill(root / PAGE, table(report))
    return report


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--folder", type=Path, required=True, help="of the clone and what is kept")
    parser.add_argument("--recording", type=Path, help="MCAP of a band, for `sling fit`")
    parser.add_argument("--mass", type=float, default=0.0408, help="of that band, in kg")
    arguments = parser.parse_args()
    file, words = arguments.recording, "--folder FOLDER"
    if file and not file.is_file():
        raise UserError(f"{file}: no such file")
    skipped = {} if file else dict.fromkeys(NEED_RECORDING, "no --recording was given")
    words += f" --recording {file.name} --mass {arguments.mass:g}" if file else ""
    todo = steps(file, arguments.mass)
    report = times(todo, arguments.folder.resolve(), ROOT, skipped, words)
    return 0 if report["met"] else 1


if __name__ == "__main__":
    errors.run(main)
