"""How far the stages of one band are, and how long the rest may take."""

from __future__ import annotations

import sys
import time

from pipeline.base.progress import parse

STEPS = {  # seconds on two cores for a recording of 9 s, and what happens
    "record": (45, "the virtual rig records a pull"),
    "episode": (14, "reading force and point clouds"),
    "mounting": (5, "fitting how the band hangs"),
    "history": (6, "exploring the box of parameters"),
    "theta": (8, "fitting the parameters"),
    "policy": (13, "training the policy"),
    "trials": (5, "predicting its launches"),
    "card": (11, "drawing the card"),
}


class Countdown:
    """Lines on stderr, a stage each; on a terminal the last one tells of the work in it."""

    def __init__(self, source: str) -> None:
        """Of a band from the `rig` or a `recording`."""
        self.steps = [step for step in STEPS if step != "record" or source == "rig"]
        self.start = self.begun = time.monotonic()
        self.worth = 0.0  # of the stages that have run, in seconds of STEPS
        self.pace = 1.0
        self.now: str | None = None
        self.bar = sys.stderr.isatty()

    def begins(self, stage: str) -> None:
        """A stage of dvc.yaml begins: theta@orange-least_squares."""
        self._done()
        self.now, self.begun = stage.partition("@")[0], time.monotonic()
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
        if self.now in STEPS:
            self.worth += STEPS[self.now][0]
            self.pace = (time.monotonic() - self.start) / self.worth
        self.now = None

    def _show(self, facts: str = "") -> None:
        number = self.steps.index(self.now) + 1 if self.now in self.steps else 0
        rest = sum(STEPS[step][0] for step in self.steps[max(number - 1, 0) :])
        left = max(rest * self.pace - (time.monotonic() - self.begun), 1)
        words = STEPS[self.now][1] if self.now in STEPS else self.now
        text = f"[{number}/{len(self.steps)}] {words}, about {_clock(left)} left"
        if self.bar:
            print(f"\r{text}  {facts}\x1b[K", end="", file=sys.stderr, flush=True)
        else:
            self._print(text)

    def _print(self, text: str) -> None:
        begin = "\r\x1b[K" if self.bar else ""
        print(f"{begin}{text}", file=sys.stderr, flush=True)


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"
