"""How far a command is, in lines on stderr; the time left is revised with each step."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping


class Steps:
    """The steps of one command, in order."""

    def __init__(self, costs: Mapping[str, float]) -> None:
        """Begin.

        Args:
            costs: What each step takes on a usual machine [s]; on this one all are as much slower
                as those that are done.
        """
        self.costs = dict(costs)
        self._begun = time.monotonic()

    def begin(self, name: str) -> None:
        """Say that those before are done, and that the step of this name begins."""
        names, costs = [*self.costs], [*self.costs.values()]
        number = names.index(name)
        done = sum(costs[:number])
        pace = (time.monotonic() - self._begun) / done if done else 1.0
        left = round(pace * sum(costs[number:]))
        self.say(f"[{number + 1}/{len(names)}] {name}; about {left // 60}:{left % 60:02} left", 0)

    def say(self, line: str, indent: int = 6) -> None:
        """Print a line of the present step."""
        print(f"{' ' * indent}{line}", file=sys.stderr, flush=True)
