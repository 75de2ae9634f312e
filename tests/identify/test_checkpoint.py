"""A search that is killed goes on to the same result; what does not fit is thrown away."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.identify.checkpoint import Recorded, fingerprint, load_batch
from pipeline.identify.evaluate import Evaluation
from tests.identify.toy import quadratic

ROOT = Path(__file__).parents[2]
BATCHES = 13 + 8  # of the chain's exploration and refinement


def run(folder: Path, output: Path, fatal: int) -> subprocess.CompletedProcess:
    output.mkdir(exist_ok=True)
    return subprocess.run(
        [sys.executable, "-m", "tests.identify.killed", str(folder), str(output), str(fatal)],
        cwd=ROOT,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )


def test_sigkill_and_on_to_the_same_bytes(tmp_path: Path) -> None:
    """Killed in the exploration, then in the refinement; nothing is evaluated twice."""
    whole = run(tmp_path / "one", tmp_path / "whole", 10**6)
    assert whole.returncode == 0, whole.stderr
    assert int(whole.stdout) == BATCHES
    for fatal in (5, 10):
        killed = run(tmp_path / "two", tmp_path / "parts", fatal)
        assert killed.returncode == -signal.SIGKILL
        assert not list((tmp_path / "parts").iterdir())
    last = run(tmp_path / "two", tmp_path / "parts", 10**6)
    assert last.returncode == 0, last.stderr
    assert int(last.stdout) == BATCHES - 5 - 10
    for name in ("a.parquet", "b.parquet"):
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


class Counting:
    """Counts the batches that were really evaluated."""

    def __init__(self) -> None:
        self.count = 0
        self._inner = quadratic(np.zeros(2), np.eye(2), fails=lambda unit: unit[:, 0] > 0.9)

    def __call__(self, unit: np.ndarray):
        self.count += 1
        return self._inner(unit)


def batches(*firsts: float) -> list[np.ndarray]:
    return [np.array([[first, 0.5], [0.95, 0.1]]) for first in firsts]


@pytest.fixture
def recorded(tmp_path: Path):
    """Opens the same folder again for batches: how many were really evaluated, and what came."""

    def evaluate(units: list[np.ndarray], stamp: str = "x") -> tuple[int, list[Evaluation]]:
        counting = Counting()
        recorder = Recorded(counting, tmp_path / "checkpoint", stamp)
        found = [recorder(unit) for unit in units]
        return counting.count, found

    return evaluate


def test_a_replay_recalls_everything(recorded) -> None:
    count, first = recorded(batches(0.1, 0.2))
    assert count == 2
    count, again = recorded(batches(0.1, 0.2, 0.3))
    assert count == 1
    for one, other in zip(first, again, strict=False):
        for name in ("unit", "theta", "total"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert one.failure == other.failure == [None, "no"]
        np.testing.assert_array_equal(one.terms["geom"], other.terms["geom"])


def test_another_course_drops_what_follows(recorded, tmp_path: Path) -> None:
    recorded(batches(0.1, 0.2, 0.3))
    count, found = recorded(batches(0.1, 0.21))
    assert count == 1
    np.testing.assert_array_equal(found[1].unit, batches(0.21)[0])
    assert sorted(file.name for file in (tmp_path / "checkpoint").glob("*.npz")) == [
        "000000.npz",
        "000001.npz",
    ]


def test_other_inputs_start_over(recorded) -> None:
    recorded(batches(0.1, 0.2))
    assert recorded(batches(0.1, 0.2), "y")[0] == 2
    assert recorded(batches(0.1, 0.2), "y")[0] == 0


def test_a_damaged_batch_is_evaluated_again(recorded, tmp_path: Path) -> None:
    recorded(batches(0.1, 0.2))
    damaged = tmp_path / "checkpoint" / "000001.npz"
    damaged.write_bytes(damaged.read_bytes()[:200])
    assert load_batch(damaged) is None
    assert recorded(batches(0.1, 0.2))[0] == 1
    assert recorded(batches(0.1, 0.2))[0] == 0


def test_the_fingerprint_covers_contents_and_sources(tmp_path: Path) -> None:
    (tmp_path / "code").mkdir()
    data, source = tmp_path / "data.parquet", tmp_path / "code" / "solver.h"
    data.write_text("1")
    source.write_text("2")
    parts = ("params", data, tmp_path / "code")
    first = fingerprint(*parts)
    assert fingerprint(*parts) == first
    assert fingerprint("other", *parts[1:]) != first
    for file in (data, source):
        file.write_text(file.read_text() + "3")
        assert fingerprint(*parts) != first
        first = fingerprint(*parts)
