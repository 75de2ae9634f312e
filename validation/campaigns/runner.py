"""What campaigns of many jobs share: results that outlive a kill, processes, and the report.

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
from multiprocessing import active_children
from pathlib import Path
from threading import Lock
from typing import TypeVar

import numpy as np

from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.machine import cores
from pipeline.base.pool import Pool

THREADS = ("SLING_WORKERS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
OURS, PAPER = "least_squares", "sling2sim2real"  # methods of params.yaml
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
        names = [field.name for field in fields(kind)]
        return {kind(*(line[name] for name in names)): line for line in self.lines}

    def among(self, jobs: Iterable[object]) -> list[Result]:
        """Results of those of some jobs of one kind that have one, in the order of the jobs."""
        jobs = list(jobs)
        there = self.of(type(jobs[0])) if jobs else {}
        return [there[job] for job in jobs if job in there]

    def where(self, **values: object) -> list[Result]:
        """Lines with these values."""
        return [line for line in self.lines if all(line[name] == v for name, v in values.items())]


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
    work: Callable[[Job], Result | None],
    jobs: Iterable[Job],
    workers: int,
    minutes: float = 1e4,
) -> Iterator[tuple[Job, Result | None]]:
    """Jobs and what `work` makes of them as they are done, one a process with one thread.

    Ends early, and says so, when the time is over: what is under way then is lost. Raises what
    `work` raises.
    """
    with single_threaded(), Pool(workers=workers) as pool:
        waiting = {pool.submit(work, job): job for job in jobs}
        try:
            for count, done in enumerate(as_completed(waiting, timeout=60 * minutes), 1):
                print(f"{count} of {len(waiting)}: {waiting[done]}", flush=True)
                yield waiting[done], done.result()
        except TimeoutError:
            print("the time is over; run it again to go on", flush=True)
            for process in active_children():
                process.terminate()
        finally:  # after an error too, nothing else begins
            pool.shutdown(wait=False, cancel_futures=True)


def run(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    results: ResultLines,
    workers: int,
    minutes: float = 1e4,
) -> None:
    """Add the results of jobs that have none yet, until the time is over."""
    there = results.of(type(jobs[0])) if jobs else {}
    for _, result in each(work, [job for job in jobs if job not in there], workers, minutes):
        results.add(result)


def result_of(job: object, work: Callable[[], Mapping], **more: object) -> Result:
    """A job's result as JSON has it; that no simulation can follow the recording is one too."""
    try:
        done = work()
    except UserError as error:
        done = {"failed": str(error)}
    return plain(vars(job) | more | done)


def made_once(path: Path, make: Callable[[], object]):
    """The content of a JSON file, which is made where it is missing."""
    if not path.exists():
        write_json(path, make())
    return json.loads(path.read_text(encoding="utf-8"))


def plain(value: object, digits: int | None = None):
    """Convert for JSON: NumPy's numbers to Python's, not finite to null; floats to some digits."""
    if isinstance(value, dict):
        return {str(key): plain(part, digits) for key, part in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(part, digits) for part in value]
    if isinstance(value, (float, np.floating)):
        if not np.isfinite(value):
            return None
        return float(value) if digits is None else float(f"{value:.{digits}g}")
    return value.item() if isinstance(value, np.generic) else value


def parser(
    doc: str, report: Path, work: Path | None = None, minutes: bool = False
) -> argparse.ArgumentParser:
    """A campaign's arguments: --report; of many jobs --workers and --work; and --minutes."""
    options = argparse.ArgumentParser(description=doc.partition("\n")[0])
    options.add_argument("--report", type=Path, default=report, help=f"(default: {report})")
    if work is not None:
        options.add_argument("--work", type=Path, default=work, help=f"folder (default: {work})")
        options.add_argument(
            "--workers", type=int, default=cores(), help="processes (default: cores)"
        )
    if minutes:
        end = "then it ends; the same command goes on"
        options.add_argument("--minutes", type=float, default=1e4, help=end)
    return options
