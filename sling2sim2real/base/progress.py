"""What everything long says of itself: lines in logs/ and on stderr, on a terminal a bar.

    history-band1-de 48/600 rollouts  generation 4  best 0.43215  12.3 rollouts/s  0:45 left

Times are measured here alone and stay in these lines: no result holds one.
"""

from __future__ import annotations

import re
import sys
import time
from dataclasses import dataclass
from pathlib import Path

BAR = 30  # characters
LINE = re.compile(r"(?P<title>\S+) (?P<done>\d+)/(?P<total>\d+) (?P<unit>\w+)(?:  (?P<facts>.*))?")


@dataclass(frozen=True)
class Step:
    """How far something is.

    Attributes:
        title: Of what: stage, band and method, without blanks.
        done: How many units, of `total`.
        unit: What is counted: rollouts, iterations.
        facts: The rest of the line: generation, best loss or mean error, rate, time left.
    """

    title: str
    done: int
    total: int
    unit: str
    facts: tuple[str, ...] = ()

    @property
    def counted(self) -> str:
        """The line without its title."""
        return "  ".join([f"{self.done}/{self.total} {self.unit}", *self.facts])

    def __str__(self) -> str:
        return f"{self.title} {self.counted}"


def parse(line: str) -> Step | None:
    """The step that a line tells of; None for any other line."""
    match = LINE.fullmatch(line.rstrip())
    if match is None or not 0 <= int(match["done"]) <= int(match["total"]) > 0:
        return None
    facts = tuple(match["facts"].split("  ")) if match["facts"] else ()
    return Step(match["title"], int(match["done"]), int(match["total"]), match["unit"], facts)


class Progress:
    """Tells how far something long is, and how fast."""

    def __init__(
        self, title: str, total: int, unit: str, log: Path | None = None, *, every: float = 0.0
    ) -> None:
        """Begin.

        Args:
            title: Without blanks.
            log: Default logs/<title>.log; an earlier run's lines stay in it.
            every: Least time between two lines [s]; the last one is always reported.
        """
        self.title, self.total, self.unit, self.every = title, total, unit, every
        self.log = log or Path("logs", f"{title}.log")
        self.done = self._said = 0  # units; those of the last line
        self._begun = self._spoke = time.monotonic()
        self.log.parent.mkdir(parents=True, exist_ok=True)
        self._write(time.strftime(f"%Y-%m-%d %H:%M:%S {title}: {total} {unit}"))

    def advance(self, count: int, *facts: str) -> None:
        """Tell of `count` more units, and `facts` of them."""
        now = time.monotonic()
        self.done += count
        if self._said and now - self._spoke < self.every and self.done < self.total:
            return
        rate = f"{(self.done - self._said) / (now - self._spoke):.1f} {self.unit}/s"
        self._said, self._spoke = self.done, now
        self._tell(
            Step(self.title, self.done, self.total, self.unit, (*facts, rate, *self._left(now)))
        )

    def _left(self, now: float) -> list[str]:
        """Time left, at the mean rate."""
        if self.done >= self.total:
            return []
        left = round((self.total - self.done) * (now - self._begun) / self.done)
        hours, minutes, seconds = left // 3600, left // 60 % 60, left % 60
        return [
            f"{hours}:{minutes:02}:{seconds:02} left" if hours else f"{minutes}:{seconds:02} left"
        ]

    def _tell(self, step: Step) -> None:
        self._write(step.counted)
        if not sys.stderr.isatty():
            print(step, file=sys.stderr, flush=True)
            return
        filled = BAR * step.done // step.total
        bar = "#" * filled + "-" * (BAR - filled)
        end = "\n" if step.done >= step.total else ""
        shown = f"\r{step.title} [{bar}] {step.counted}\x1b[K"
        print(shown, end=end, file=sys.stderr, flush=True)

    def _write(self, line: str) -> None:
        with self.log.open("a", encoding="utf-8") as file:
            file.write(line + "\n")
