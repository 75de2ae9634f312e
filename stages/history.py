"""Search the whole box of parameters by differential evolution; keep everything evaluated.

    python -m stages.history band1 sling2sim2real

Reads data/episodes/<band>/; writes data/history/<band>/<method>.parquet. Killed, it resumes from
.checkpoints/. SLING_DEVICE and SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from pathlib import Path

from pipeline import errors
from pipeline.identify.explore import explore
from pipeline.identify.history import History
from pipeline.identify.session import session
from pipeline.sling.model import THETA
from pipeline.stage import started


def main() -> None:
    params, band, method = started("band", "method")
    history = History(method, THETA)
    with session("history", band, method, params, params.optimizer.generations + 1) as evaluate:
        explore(evaluate, params.optimizer, history)
        history.save(Path("data/history", band, f"{method}.parquet"))


if __name__ == "__main__":
    errors.run(main)
