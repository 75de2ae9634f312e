"""What campaigns share: a run that was killed goes on, and a failure is a result."""

import os
from dataclasses import dataclass

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from validation.campaigns.runner import (
    ResultLines,
    run,
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


def broken(job: Square) -> dict:
    if job.number == 1:
        raise ValueError("a fault of ours")
    return job()


def test_an_error_ends_the_run_and_what_was_done_is_kept(tmp_path) -> None:
    lines = ResultLines(tmp_path / "results.jsonl")
    with pytest.raises(ValueError, match="a fault of ours"):
        run(broken, [Square(n) for n in range(200)], lines, 1)
    assert Square(0) in lines.of(Square) and len(lines.lines) < 200


def test_results_are_plain_json() -> None:
    value = {1: (np.float64(1 / 3), np.nan, np.int64(2), np.bool_(True)), "a": np.zeros(2)}
    assert plain(value) == {"1": [1 / 3, None, 2, True], "a": [0.0, 0.0]}
    assert plain(1 / 3, 3) == 0.333
