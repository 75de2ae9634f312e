"""How far a command is: a bar on a terminal, plain lines in a log; the time left is revised."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping

BAR = 24  # characters


class Steps:
    """The steps of one command, in order."""

    def __init__(self, costs: Mapping[str, float]) -> None:
        """Begin.

        Args:
            costs: What each step takes on a usual machine [s]; on this one all are as much slower
                as those that are done.
        """
        self.costs = dict(costs)
        self.done = 0.0
        self._now: str | None = None
        self._begun = time.monotonic()
        self._bar = sys.stderr.isatty()

    def begin(self, name: str) -> None:
        """End the step before, if any, and begin the one of this name."""
        self._end()
        self._now = name
        if self._bar:
            self._draw()
        else:
            number = [*self.costs].index(name) + 1
            self.say(f"[{number}/{len(self.costs)}] {name}{self._left()}", indent=0)

    def inside(self, part: float) -> None:
        """Tell how much of the present step is done, from 0 to 1."""
        if self._bar:
            self._draw(part)

    def say(self, line: str, indent: int = 6) -> None:
        """Print a line, above the bar."""
        clear = "\r\x1b[K" if self._bar else ""
        print(f"{clear}{' ' * indent}{line}", file=sys.stderr, flush=True)
        if self._bar and self._now:
            self._draw()

    def finish(self) -> None:
        """End the last step."""
        self._end()
        self._now = None
        if self._bar:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _end(self) -> None:
        if self._now:
            self.done += self.costs[self._now]

    def _left(self, part: float = 0.0) -> str:
        """Time left, by what the steps that are done have taken."""
        total = sum(self.costs.values())
        done = self.done + (part * self.costs[self._now] if self._now else 0.0)
        pace = (time.monotonic() - self._begun) / done if done else 1.0
        left = round(pace * (total - done))
        return f"; about {left // 60}:{left % 60:02} left" if left else ""

    def _draw(self, part: float = 0.0) -> None:
        total = sum(self.costs.values())
        filled = round(BAR * (self.done + part * self.costs[self._now or ""]) / total)
        bar = "#" * filled + "-" * (BAR - filled)
        text = f"\r[{bar}] {self._now}{self._left(part)}\x1b[K"
        print(text, end="", file=sys.stderr, flush=True)
