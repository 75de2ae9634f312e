"""A search that kills itself in the middle of its batch number `argv[4]`; see test_cache.py.

python -m tests.identify.search.killed OPTIMISER MEMORY OUTPUT BATCH
"""

import os
import signal
import sys
from pathlib import Path

import numpy as np

from pipeline.identify.objective.cache import EvaluationCache
from pipeline.identify.search.evaluations import Evaluations
from tests.identify.search.functions import CENTRE, Evaluate, alone, chain, correlated, quadratic

ROLLOUTS = 150
VALLEY = quadratic(CENTRE, correlated()).function


def searched(name: str, evaluate) -> list[Evaluations]:
    """All histories of a search by that name."""
    if name == "multistart":
        return list(chain(evaluate)[:2])
    return [alone(name, evaluate, ROLLOUTS)]


def main() -> None:
    name, folder, output, fatal = sys.argv[1], *map(Path, sys.argv[2:4]), int(sys.argv[4])

    def dies(unit: np.ndarray) -> np.ndarray:
        if evaluate.count > fatal:
            os.kill(os.getpid(), signal.SIGKILL)
        return VALLEY(unit)

    evaluate = Evaluate(dies)
    for number, evaluations in enumerate(
        searched(name, EvaluationCache(evaluate, folder, "inputs"))
    ):
        evaluations.save(output / f"{number}.parquet")
    print(evaluate.count)


if __name__ == "__main__":
    main()
