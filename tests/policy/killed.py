"""A short training on the toy slingshot that may kill its own process.

python -m tests.policy.killed CHECKPOINT ITERATION
"""

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

from pipeline.launching.surface.landing_map import LandingMap
from pipeline.policy import train as module
from tests.policy import toy
from tests.policy.conftest import SETTINGS


def training(
    kept: Path,
    on_iteration: Callable[[int], None] = lambda iteration: None,
    **changes,
) -> module.Trained:
    """Twelve iterations; `on_iteration` is told each one's number at its end, from 0."""
    chart = LandingMap.simulate(
        toy.launch, draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, size=(9, 7), max_force=15.0
    )
    settings = {**vars(SETTINGS), "iterations": 12, "envs": 64, "hidden": (32, 16), **changes}
    inner = module._Training.log

    def log(self, it: int, **about) -> None:
        on_iteration(it)
        inner(self, it=it, **about)

    module._Training.log = log
    try:
        return module.train(chart.surface, SimpleNamespace(**settings), kept)
    finally:
        module._Training.log = inner


def main() -> None:
    kept, fatal = Path(sys.argv[1]), int(sys.argv[2])

    def die(iteration: int) -> None:
        if iteration + 1 == fatal:
            os.kill(os.getpid(), signal.SIGKILL)

    training(kept, die)


if __name__ == "__main__":
    main()
