"""How far the stages of one band are, and how long the rest may take."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from app.flow.graph import Stage
from pipeline.base.progress import parse
from stages.start import ungrouped

# Of a step, on two cores for a recording of 9 s, by validation/benchmarks/times.py.
SECONDS: dict[str, float] = json.loads(
    Path(__file__).with_name("seconds.json").read_text(encoding="utf-8")
)
OTHER = 5  # s


class Countdown:
    """Lines on stderr, a stage each; on a terminal the last one tells of the work in it."""

    def __init__(self, stages: Sequence[Stage]) -> None:
        """Start the clock for the stages that may run, in order."""
        self.stages = {stage.name: stage.description for stage in stages}
        self.start = self.begun = time.monotonic()
        self.worth = 0.0  # of the stages that have run, in seconds of SECONDS
        self.pace = 1.0
        self.left = float("inf")  # what was said last [s]: never more is said after it
        self.now: str | None = None
        self.bar = sys.stderr.isatty()

    def begins(self, stage: str) -> None:
        """A stage of dvc.yaml begins: theta@orange-least_squares."""
        self._done()
        self.now, self.begun = stage, time.monotonic()
        self._show()

    def line(self, line: str) -> None:
        """A line of the stage."""
        step = parse(line)
        if self.bar:
            self._show(step.counted if step else "")
        elif not step:
            self._print(f"      {line}")

    def ends(self) -> None:
        """The last stage has ended."""
        self._done()
        took = time.monotonic() - self.start
        self._print(f"done in {took:.0f} s" if self.worth else "nothing is stale")

    def _done(self) -> None:
        if self.now in self.stages:
            self.worth += _seconds(self.now)
            self.pace = (time.monotonic() - self.start) / self.worth
        self.now = None

    def _show(self, facts: str = "") -> None:
        names = [*self.stages]
        number = names.index(self.now) + 1 if self.now in names else 0
        rest = sum(map(_seconds, names[max(number - 1, 0) :]))
        self.left = min(self.left, max(rest * self.pace - (time.monotonic() - self.begun), 1))
        words = self.stages.get(self.now or "") or self.now
        text = f"[{number}/{len(names)}] {words}; about {_clock(self.left)} left"
        if self.bar:
            print(f"\r{text}  {facts}\x1b[K", end="", file=sys.stderr, flush=True)
        else:
            self._print(text)

    def _print(self, text: str) -> None:
        begin = "\r\x1b[K" if self.bar else ""
        print(f"{begin}{text}", file=sys.stderr, flush=True)


def _seconds(stage: str) -> float:
    return SECONDS.get(ungrouped(stage.partition("@")[0]), OTHER)


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"
