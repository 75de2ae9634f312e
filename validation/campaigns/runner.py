"""What campaigns of many jobs share: arguments, results that outlive a kill, and processes.

A job is a frozen dataclass; its result is a line of JSON with the job's fields in it. A run that
was killed reads the lines that are there and goes on with the other jobs.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from contextlib import contextmanager, suppress
from dataclasses import fields
from functools import partial
from multiprocessing import active_children
from pathlib import Path
from threading import Lock
from typing import TypeVar

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import made
from sling2sim2real.base.machine import cores
from sling2sim2real.base.pool import Pool
from validation.reports import plain

THREADS = ("SLING_WORKERS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
POSTERIOR, PAPER = "posterior", "paper"  # methods of params.yaml
Job = TypeVar("Job")
Result = dict[str, object]


class ResultLines:
    """Lines of JSON in a file, one a result; the last may be cut short, where a run was killed.

    Attributes:
        lines: All of them, in the order in which they were written.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._lock = path, Lock()
        self.lines: list[Result] = []
        for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
            with suppress(json.JSONDecodeError):
                self.lines.append(json.loads(line))

    def add(self, result: Result) -> None:
        """Write a result at once, from any thread."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self._lock, self.path.open("a", encoding="utf-8") as file:
            file.write(f"\n{json.dumps(result)}\n")  # an empty line ends one that was cut
            self.lines.append(result)

    def of(self, kind: type[Job]) -> dict[Job, Result]:
        """Results by job, each as it was written last."""
        return {job_of(line, kind): line for line in self.lines}

    def among(self, jobs: Iterable[object]) -> list[Result]:
        """Results of those of some jobs of one kind that have one, in the order of the jobs."""
        jobs = list(jobs)
        there = self.of(type(jobs[0])) if jobs else {}
        return [there[job] for job in jobs if job in there]


def job_of(line: Result, kind: type[Job]) -> Job:
    """What a line of results is of."""
    return kind(*(line[field.name] for field in fields(kind)))


@contextmanager
def single_threaded() -> Iterator[None]:
    """Processes that are started in the block have one thread each."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def each(
    work: Callable[[Job], object], jobs: Iterable[Job], workers: int, minutes: float = 1e4
) -> Iterator[object]:
    """What `work` makes of jobs, as they are done, one a process with one thread.

    Ends early, and says so, when the time is over: what is under way then is lost. Raises what
    `work` raises.
    """
    with single_threaded(), Pool(workers=workers) as pool:
        waiting = {pool.submit(work, job): job for job in jobs}
        try:
            for count, done in enumerate(as_completed(waiting, timeout=60 * minutes), 1):
                print(f"{count} of {len(waiting)}: {waiting[done]}", flush=True)
                yield done.result()
        except TimeoutError:
            print("the time is over; run it again to go on", flush=True)
            for process in active_children():
                process.terminate()
        finally:  # after an error too, nothing else begins
            pool.shutdown(wait=False, cancel_futures=True)


def run(
    work: Callable[[Job], Mapping],
    jobs: Sequence[Job],
    results: ResultLines,
    workers: int,
    minutes: float = 1e4,
    **more: object,
) -> None:
    """Add results of jobs that have none yet, with `more` in each, until the time is over."""
    there = results.of(type(jobs[0])) if jobs else {}
    todo = [job for job in jobs if job not in there]
    for result in each(partial(result_of, work=work, **more), todo, workers, minutes):
        results.add(result)


def result_of(job: object, work: Callable[[object], Mapping], **more: object) -> Result:
    """A job's result as JSON has it; that no simulation can follow the recording is one too."""
    try:
        done = work(job)
    except UserError as error:
        done = {"failed": str(error)}
    return plain(vars(job) | more | done)


def read(path: Path):
    """The content of a JSON file. Raises NotMade."""
    return json.loads(made(path).read_text(encoding="utf-8"))


def parser(
    doc: str | None,
    report: Path | None,
    work: Path | None = None,
) -> argparse.ArgumentParser:
    """A campaign's arguments.

    Args:
        doc: Of the script; its first line says what it is for.
        report: Default of --report; None: by what is asked for.
        work: Default of --work, the folder of what is kept of many jobs; None: no such options.
    """
    options = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    default = f"file (default: {report or 'by what is asked for'})"
    options.add_argument("--report", type=Path, default=report, help=default)
    if work is not None:
        options.add_argument("--work", type=Path, default=work, help=f"folder (default: {work})")
        workers, end = "processes (default: cores)", "then it ends; the same command goes on"
        options.add_argument("--workers", type=int, default=cores(), help=workers)
        options.add_argument("--minutes", type=float, default=1e4, help=end)
        options.add_argument("--report-only", action="store_true", help="of what is there")
    return options


def prepare(args: argparse.Namespace, work: Callable[[Job], object], jobs: Sequence[Job]) -> None:
    """Make what other jobs need, unless --report-only. Raises UserError when the time is over."""
    if not args.report_only:
        count = sum(1 for _ in each(work, jobs, args.workers, args.minutes))
        if count < len(jobs):
            raise UserError(f"--minutes: only {count} of {len(jobs)} are prepared")


def results_of(
    args: argparse.Namespace, work: Callable[[Job], Mapping], jobs: Sequence[Job], **more: object
) -> list[Result]:
    """Results of jobs by a campaign's arguments. Raises UserError where there is none.

    Those that are missing are made first, until the time is over; with --report-only they are not.
    """
    results = ResultLines(args.work / "results.jsonl")
    if not args.report_only:
        run(work, jobs, results, args.workers, args.minutes, **more)
    found = results.among(jobs)
    if not found:
        raise UserError(f"{args.work}: holds no result of these jobs yet")
    return found
