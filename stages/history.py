"""Search the whole box of parameters by differential evolution; keep everything evaluated.

    python -m stages.history band1 sling2sim2real

Reads data/episodes/<band>/; writes data/history/<band>/<method>.parquet. Killed, it resumes from
.checkpoints/. SLING_DEVICE and SLING_WORKERS say where it runs.
"""

from __future__ import annotations

import sys
from pathlib import Path

from pipeline import errors
from pipeline.identify.explore import explore
from pipeline.identify.history import History
from pipeline.identify.session import session
from pipeline.params import load
from pipeline.sling.model import THETA


def main() -> None:
    band, method = sys.argv[1:]
    params = load()
    history = History(method, THETA)
    with session("history", band, method, params, params.optimizer.generations + 1) as evaluate:
        explore(evaluate, params.optimizer, history)
        history.save(Path("data/history", band, f"{method}.parquet"))


if __name__ == "__main__":
    errors.run(main)
