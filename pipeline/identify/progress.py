"""What a long search says of itself: lines in a log, and a bar on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pipeline.identify.evaluate import Evaluation

BAR = 30


class Progress:
    """An evaluator that reports each batch; wall times stay in the log, out of every result."""

    def __init__(
        self, evaluate: Callable[[np.ndarray], Evaluation], title: str, rollouts: int, log: Path
    ) -> None:
        self.evaluate, self.title, self.rollouts, self.log = evaluate, title, rollouts, log
        self._done, self._best = 0, np.inf
        log.parent.mkdir(parents=True, exist_ok=True)
        self._write(time.strftime(f"%Y-%m-%d %H:%M:%S {title}: {rollouts} rollouts"))

    def __call__(self, unit: np.ndarray) -> Evaluation:
        evaluation = self.evaluate(unit)
        count, seconds = len(evaluation.total), evaluation.seconds
        self._done += count
        self._best = min(self._best, evaluation.total.min())
        failed = int(np.isinf(evaluation.total).sum())
        speed = f"{count / seconds:.1f} rollouts/s" if seconds else "recalled"
        line = (
            f"{self._done}/{self.rollouts}  best {self._best:.5g}  failed {failed}/{count}  {speed}"
        )
        self._write(line)
        if sys.stderr.isatty():
            filled = BAR * self._done // self.rollouts
            bar = "#" * filled + "-" * (BAR - filled)
            end = "\n" if self._done == self.rollouts else ""
            print(f"\r{self.title} [{bar}] {line}\x1b[K", end=end, file=sys.stderr, flush=True)
        else:
            print(f"{self.title} {line}", file=sys.stderr, flush=True)
        return evaluation

    def _write(self, line: str) -> None:
        with self.log.open("a", encoding="utf-8") as file:
            file.write(line + "\n")
