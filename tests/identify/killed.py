"""A search that kills itself in the middle of its batch number `argv[3]`; see test_checkpoint.py.

python -m tests.identify.killed CHECKPOINTS OUTPUT BATCH
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np

from pipeline.identify.checkpoint import Recorded
from tests.identify.toy import CENTRE, chain, correlated, quadratic


def main() -> None:
    folder, output, fatal = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    inner = quadratic(CENTRE, correlated())
    evaluated = 0

    def evaluate(unit: np.ndarray):
        nonlocal evaluated
        if evaluated == fatal:
            os.kill(os.getpid(), signal.SIGKILL)
        evaluated += 1
        return inner(unit)

    recorded = Recorded(evaluate, folder, "inputs")
    for name, history in zip(("a", "b"), chain(recorded)[:2], strict=True):
        history.save(output / f"{name}.parquet")
    print(evaluated)


if __name__ == "__main__":
    main()
