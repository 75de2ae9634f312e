"""How far a command is: a bar on a terminal, plain lines in a log; the time left is revised."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping

BAR = 24  # characters


class Steps:
    """The steps of one command, in order."""

    def __init__(self, costs: Mapping[str, float]) -> None:
        """Of steps by name.

        Args:
            costs: What each takes [s], on some machine: the time left is scaled to this one as soon
                as those that are done.
        """
        self.costs = dict(costs)
        self._begun = time.monotonic()
        self._bar = ""  # on a terminal, of the present step

    def begin(self, name: str) -> None:
        """Say that those before are done, and that the step of this name begins."""
        names, costs = [*self.costs], [*self.costs.values()]
        number = names.index(name)
        done = sum(costs[:number])
        pace = (time.monotonic() - self._begun) / done if done else 1.0
        left = round(pace * sum(costs[number:]))
        now = f"{name}; about {left // 60}:{left % 60:02} left"
        if not sys.stderr.isatty():
            self.say(f"[{number + 1}/{len(names)}] {now}", 0)
            return
        filled = round(BAR * done / sum(costs))
        self._bar = f"[{'#' * filled}{'-' * (BAR - filled)}] {now}"
        self._print("")

    def say(self, line: str, indent: int = 6) -> None:
        """Print a line of the present step, above the bar."""
        self._print(f"{' ' * indent}{line}\n")

    def finish(self) -> None:
        """End the last step."""
        bar, self._bar = self._bar, ""
        if bar:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _print(self, text: str) -> None:
        clear = "\r\x1b[K" if self._bar else ""
        print(f"{clear}{text}{self._bar}", end="", file=sys.stderr, flush=True)
