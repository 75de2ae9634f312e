"""What campaigns share: a run that was killed goes on, and a failure is a result."""

import os
import time
from argparse import Namespace
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from validation.campaigns.runner import (
    THREADS,
    ResultLines,
    prepare,
    results_of,
    run,
    single_threaded,
)
from validation.reports import plain


@dataclass(frozen=True)
class Square:
    number: int

    def __call__(self) -> dict:
        if self.number < 0:
            raise UserError("no square")
        return {"square": self.number**2, "threads": os.environ["OMP_NUM_THREADS"]}


def test_a_run_that_was_killed_goes_on(tmp_path) -> None:
    """The last line may be cut short; that one is done again."""
    path = tmp_path / "work" / "results.jsonl"
    ResultLines(path).add({"number": 2, "square": "kept"})
    with path.open("a") as file:
        file.write('{"number": 3, "squ')
    run(Square.__call__, [Square(2), Square(3), Square(-1)], ResultLines(path), 1)
    assert ResultLines(path).of(Square) == {
        Square(2): {"number": 2, "square": "kept"},
        Square(3): {"number": 3, "square": 9, "threads": "1"},
        Square(-1): {"number": -1, "failed": "no square"},
    }
    run(None, [Square(2), Square(3)], ResultLines(path), 1)  # nothing is left to do
    some = ResultLines(path).among([Square(3), Square(5), Square(2)])
    assert [row["number"] for row in some] == [3, 2]


def slow(job: Square) -> dict:
    time.sleep(60)
    return job()


def test_a_run_ends_when_the_time_is_over(tmp_path, capsys) -> None:
    """Also what is under way."""
    lines, begin = ResultLines(tmp_path / "results.jsonl"), time.monotonic()
    run(slow, [Square(n) for n in range(50)], lines, 1, minutes=0.02)
    assert time.monotonic() - begin < 50
    assert not lines.lines and "the time is over" in capsys.readouterr().out


def broken(job: Square) -> dict:
    if job.number == 1:
        raise ValueError("a fault of ours")
    return job()


def test_an_error_ends_the_run_and_what_was_done_is_kept(tmp_path) -> None:
    lines = ResultLines(tmp_path / "results.jsonl")
    with pytest.raises(ValueError, match="a fault of ours"):
        run(broken, [Square(n) for n in range(200)], lines, 1)
    assert Square(0) in lines.of(Square) and len(lines.lines) < 200


def test_threads_are_as_before_after_the_block(monkeypatch) -> None:
    monkeypatch.setenv(THREADS[0], "7")
    monkeypatch.delenv(THREADS[1], raising=False)
    with single_threaded():
        assert {os.environ[name] for name in THREADS} == {"1"}
    assert os.environ[THREADS[0]] == "7" and THREADS[1] not in os.environ


@pytest.mark.parametrize("only", [False, True])
def test_results_by_arguments_are_of_these_jobs_and_made_where_missing(tmp_path, only) -> None:
    args = Namespace(work=tmp_path, workers=1, minutes=10.0, report_only=only)
    ResultLines(tmp_path / "results.jsonl").add({"number": 2, "square": 4})
    lines = results_of(args, Square.__call__, [Square(3), Square(2)], seed=1)
    assert [line["number"] for line in lines] == ([2] if only else [3, 2])
    assert all(line["square"] == line["number"] ** 2 for line in lines)
    assert [line for line in lines if "seed" in line] == lines[:-1]  # in what was made now
    with pytest.raises(UserError, match=f"^{tmp_path}: holds no result of these jobs yet$"):
        results_of(Namespace(**{**vars(args), "report_only": True}), None, [Square(7)])


def test_what_jobs_need_is_prepared_unless_a_report_is_all(tmp_path) -> None:
    args = Namespace(workers=1, minutes=10.0, report_only=False)
    prepare(args, partial(touch, tmp_path), [Square(1), Square(2)])
    assert {file.name for file in tmp_path.iterdir()} == {"1", "2"}
    prepare(Namespace(report_only=True), None, [Square(3)])
    args.minutes = 0.0
    with pytest.raises(UserError, match="^--minutes: only 0 of 1 are prepared$"):
        prepare(args, slow, [Square(4)])


def touch(folder: Path, job: Square) -> None:
    (folder / str(job.number)).touch()


def test_results_are_plain_json() -> None:
    value = {1: (np.float64(1 / 3), np.nan, np.int64(2), np.bool_(True)), "a": np.zeros(2)}
    assert plain(value) == {"1": [1 / 3, None, 2, True], "a": [0.0, 0.0]}
    assert plain(1 / 3, 3) == 0.333
