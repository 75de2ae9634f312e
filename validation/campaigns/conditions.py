"""Every command where something is not as it should be: no traceback, and nothing half changed.

    python -m validation.campaigns.conditions --workers 2

Each cell is a copy of a small finished project, in which one command runs under one condition: on a
read-only disk, as another user, without an active environment, and so on. It ends as is expected,
says at most one line of error, and where it refuses, Git sees no change. It writes
reports/validation/conditions.json; a run that was killed goes on where it was. Only root may mount
disks and be other users; for others these conditions are left out.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from pipeline.base import errors
from pipeline.base.code import ROOT, digests
from validation.campaigns import runner
from validation.campaigns.runner import Result, ResultLines
from validation.projects import SLING, TINY, ProjectCopy, copy_project, run_of
from validation.reports import write_report

WORK, REPORT = Path("build/conditions"), Path("reports/validation/conditions.json")
LIMIT = 900.0  # s for a command
RELEASE_ERROR = 600  # characters of what a command said
USER = 1234  # who has no name and owns nothing
# What only it may do is read: Python itself may lie where only root looks.
AS_USER = (
    *("setpriv", f"--reuid={USER}", f"--regid={USER}", "--clear-groups"),
    *("--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"),
)
DRAW = "--draw=-0.30,-0.15"
COMMANDS = {
    "fit": "fit mine.mcap --mass 0.023 --name new",
    "add-band": "add-band new --recording more.mcap --mass 0.023",
    "add-recording": "add-recording --band band1 more.mcap",
    "setup": "setup --max-force 40",
    "drift": "drift --band mine",
    "remove-band": "remove-band mine --yes",
    "reset": "reset optimizer.k_top",  # which is as committed
    "check": "check mine.mcap",
    "plan": "plan --band band1 --recording mine.mcap",
    "launch": f"launch --theta data/theta/band1/least_squares.json --band band1 {DRAW}",
    "aim": "aim --band band1 --target 1.925 --force",
    "observe": f"observe --band band1 {DRAW} --landing 1.85",
    "export": "export --band band1 --to yaml",
    "flow": "flow",
    "ui": "ui --port {port}",
    "verify": "verify --device cuda:9",  # refused anywhere: it takes too long for each cell
    "bench": "bench --recording mine.mcap",
    "figures": "figures",
    "dvc repro": "repro --force --single-item theta@band1-least_squares",
}
SHOW = {"check", "launch", "aim", "bench", "figures", "reset"}  # they write nothing
REFUSED = {  # conditions in which one command cannot do what it is for
    ("project of another user", "reset"),  # Git gives nothing of another user's
    ("port in use", "ui"),
    ("no git", "reset"),
    ("no git", "dvc repro"),  # DVC itself wants Git, or to know
}
FIXED = "read only project", "project of another user"  # nothing can be written
ROOTS = (*FIXED, "temporary folder full and noexec", "no home and no name")


@dataclass(frozen=True)
class Cell:
    condition: str
    command: str


NOT_OURS = (Cell("no home and no name", "dvc repro"),)  # DVC itself does not start without


@dataclass
class Place:
    """Where a cell's command runs.

    Attributes:
        folder: Of the cell: the copy of the project, temporary files.
        copy: The project.
        environment: The whole of it.
        prefix: What stands before the command.
        port: For `sling ui`.
    """

    folder: Path
    copy: Path
    environment: dict[str, str]
    port: int
    prefix: list[str] = field(default_factory=list)
    held: ExitStack = field(default_factory=ExitStack)


CONDITIONS: dict[str, Callable[[Place], None]] = {}


def condition(function: Callable[[Place], None]) -> Callable[[Place], None]:
    """Put one into the table, under its own name."""
    CONDITIONS[function.__name__.replace("_", " ")] = function
    return function


def mounted(place: Path, how: str) -> list[str]:
    """A prefix that mounts something, for the command alone."""
    return ["unshare", "-m", "sh", "-c", f'{how} && cd "$PWD" && exec "$@"', str(place)]


@condition
def read_only_project(at: Place) -> None:
    how = 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0"'
    at.prefix += mounted(at.copy, how)


@condition
def project_of_another_user(at: Place) -> None:
    at.prefix += AS_USER
    at.environment |= {"HOME": "/", "TMPDIR": "/tmp"}
    del at.environment["DVC_SITE_CACHE_DIR"]


@condition
def no_active_environment(at: Place) -> None:
    at.environment["PATH"] = "/usr/bin:/bin"


@condition
def temporary_folder_full_and_noexec(at: Place) -> None:
    how = 'mount -t tmpfs -o noexec,size=64k tmpfs "$0" && { head -c 1M /dev/zero >"$0"/x'
    at.prefix += mounted(at.folder / "tmp", f"{how} 2>/dev/null || true; }}")


@condition
def no_compiler(at: Place) -> None:
    tools = at.folder / "tools"
    tools.mkdir()
    for name in ("sh", "git", "env", "uname", "dirname"):
        (tools / name).symlink_to(shutil.which(name) or name)
    at.environment["PATH"] = f"{Path(sys.executable).parent}:{tools}"
    at.environment["XDG_CACHE_HOME"] = str(at.folder.parent / "kernels")  # none is compiled yet


@condition
def no_home_and_no_name(at: Place) -> None:
    subprocess.run(["chown", "-R", f"{USER}:{USER}", at.folder], check=True)
    at.prefix += AS_USER
    del at.environment["HOME"]
    for name in ("USER", "LOGNAME", "DVC_SITE_CACHE_DIR"):
        at.environment.pop(name, None)


@condition
def locale_c(at: Place) -> None:
    words = {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    at.environment |= words | {"PYTHONIOENCODING": "ascii:strict"}


@condition
def odd_path(at: Place) -> None:
    at.copy = at.copy.rename(at.folder / "dürers α 50% #1's [x] $HOME")


@condition
def port_in_use(at: Place) -> None:
    server = at.held.enter_context(socket.create_server(("127.0.0.1", 0)))
    at.port = server.getsockname()[1]


@condition
def no_git(at: Place) -> None:
    shutil.rmtree(at.copy / ".git")


@condition
def socks_proxy(at: Place) -> None:
    names = ("ALL_PROXY", "all_proxy", "HTTP_PROXY", "http_proxy")
    at.environment |= dict.fromkeys(names, "socks://127.0.0.1:1")


def expected(cell: Cell) -> bool:
    """Whether the command is to succeed."""
    if cell.command == "verify" or (cell.condition, cell.command) in REFUSED:
        return False
    return cell.command in SHOW or cell.condition not in FIXED


def template(work: Path) -> Path:
    """A finished project with the bands `band1`, of the rig, and `mine`, of two recordings."""
    folder, temporary = work / "project", work / "project.tmp"
    if folder.is_dir():
        return folder
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir(parents=True)
    copy_project(temporary)
    (temporary / ".venv").symlink_to(sys.prefix)
    copy = ProjectCopy(temporary)
    copy.set(TINY | run_of(["band1"], ["least_squares"]))
    for seed, name in ((2, "more"), (1, "mine")):
        copy.set({"rig.seed": seed})
        copy(sys.executable, "-m", "stages.record", "band1")
        shutil.copy(temporary / "data/raw/band1/band1.mcap", temporary / f"{name}.mcap")
    copy.commit()
    for words in (
        "add-band mine --recording mine.mcap more.mcap --mass 0.023",
        "drift --band mine",
        "flow",
    ):
        print(f"project: {words}", flush=True)
        copy(*SLING, *words.split())
    copy.commit()
    temporary.rename(folder)
    return folder


def words_of(cell: Cell, port: int) -> list[str]:
    """The command line."""
    words = COMMANDS[cell.command].format(port=port).split()
    start = (sys.executable, "-m", "dvc") if cell.command == "dvc repro" else SLING
    return [*start, *words]


def run(cell: Cell, work: Path) -> Result:
    """Run a cell; what was wrong is under `faults`."""
    folder = work / f"{cell.condition} {cell.command}".replace(" ", "-")
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "tmp").mkdir(parents=True)
    subprocess.run(["cp", "-a", work / "project", folder / "copy"], check=True)
    if cell.command == "flow":  # else all is fresh, and no stage runs
        (folder / "copy/data/floor/band1.json").unlink()
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    variables = ProjectCopy(folder / "copy", TMPDIR=str(folder / "tmp")).environment
    variables.pop("PYTHONPATH")
    at, log = Place(folder, folder / "copy", variables, port), work / f"{folder.name}.txt"
    CONDITIONS[cell.condition](at)
    start = time.monotonic()
    with at.held, log.open("w") as message:
        command = [*at.prefix, *words_of(cell, at.port)]
        process = subprocess.Popen(
            command, cwd=at.copy, env=at.environment | {"PWD": str(at.copy)},
            stdin=subprocess.DEVNULL, stdout=message, stderr=subprocess.STDOUT,
            start_new_session=True,
        )  # fmt: skip
        status = ended(process, log)
    text = log.read_text(encoding="utf-8", errors="replace")
    faults, lines = faults_of(cell, status, text), errors_in(text)
    if not expected(cell) and (changed := changes(at.copy)):
        faults.append(f"Git sees {changed}")
    if not faults:
        shutil.rmtree(folder)
    seconds = round(time.monotonic() - start, 1)
    summary = [line.replace(str(folder), "...") for line in lines[-1:]]
    return vars(cell) | {"status": status, "seconds": seconds, "said": summary, "faults": faults}


def ended(process: subprocess.Popen, log: Path) -> int | None:
    """Its exit status; None where it takes too long. What serves is interrupted."""
    latest, interrupted = time.monotonic() + LIMIT, False
    while process.poll() is None and time.monotonic() < latest:
        time.sleep(0.2)
        if "(Ctrl-C ends it)" in log.read_text(errors="replace") and not interrupted:
            os.killpg(process.pid, signal.SIGINT)
            interrupted, latest = True, time.monotonic() + 60
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return None
    return process.returncode


def faults_of(cell: Cell, status: int | None, text: str) -> list[str]:
    """What is wrong with how a command ended, and with what it said."""
    lines, faults = errors_in(text), []
    if (status == 0) != expected(cell) or (status not in (0, 1) and cell.command != "dvc repro"):
        faults.append(f"status {status}: {text[-RELEASE_ERROR:]}")
    if "Traceback" in text:
        faults.append(f"a traceback: {text[-RELEASE_ERROR:]}")
    if expected(cell) and lines:
        faults.append(f"an error, and status 0: {lines[0]}")
    if not expected(cell) and len(lines) != 1 and cell.command != "dvc repro":
        faults.append(f"{len(lines)} lines of error: {text[-RELEASE_ERROR:]}")
    return faults


def errors_in(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.lower().startswith("error: ")]


def changes(copy: Path) -> str:
    """What Git sees, in a line; nothing where there is no Git."""
    if not (copy / ".git").is_dir():
        return ""
    words = ["git", "-c", "safe.directory=*", "status", "--porcelain"]
    done = subprocess.run(words, cwd=copy, capture_output=True, text=True)
    return " ".join(done.stdout.split())


def report(results: list[Result]) -> dict:
    """What the JSON holds, but for what it belongs to."""
    faults = [result for result in results if result["faults"]]
    return {
        "cells": len(results),
        "conditions": dict(Counter(str(result["condition"]) for result in results)),
        "refused": sum(result["status"] != 0 for result in results),
        "met": not faults,
        "results": results,
    }


def main() -> int:
    options = runner.parser(__doc__, REPORT, WORK)
    options.add_argument("--only", metavar="WORD", default="", help="cells with it in their names")
    given = options.parse_args()
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in a shell's background
        signal.signal(signal.SIGINT, signal.default_int_handler)
    work, end = given.work.resolve(), time.monotonic() + 60 * given.minutes
    if not given.report_only:
        template(work)
    lines = ResultLines(work / "results.jsonl")
    conditions, left = [*CONDITIONS], [] if os.geteuid() == 0 else [*ROOTS]
    if left:
        print(f"left out, for only root can do so: {', '.join(left)}; no report is written")
    conditions = [name for name in conditions if name not in left]
    cells = [Cell(condition, command) for condition in conditions for command in COMMANDS]
    cells = [cell for cell in cells if cell not in NOT_OURS]
    cells = [cell for cell in cells if given.only in f"{cell.condition}: {cell.command}"]
    there = lines.of(Cell)

    def run_cell(cell: Cell) -> None:
        wanted = cell not in there or there[cell]["faults"]
        if wanted and not given.report_only and time.monotonic() < end:
            lines.add(result := run(cell, work))
            outcome = result["faults"] or "as expected"
            print(f"{cell.condition}: {cell.command}: {outcome}", flush=True)

    with ThreadPoolExecutor(given.workers) as pool:
        for _ in pool.map(run_cell, cells):  # raises what a cell raises
            pass
    results = runner.expect(lines.among(cells), work)
    if len(results) < len(cells):
        print(f"{len(results)} of {len(cells)} cells, no report yet; run it again to go on")
    if not given.only and not left and len(results) == len(cells):
        code = digests(Path(__file__), ROOT / "app/cli.py")
        write_report(given.report, report(results) | {"code": code})
    return int(len(results) < len(cells) or any(result["faults"] for result in results))


if __name__ == "__main__":
    errors.run(main)
