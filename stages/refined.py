"""Refine each promising region by CMA-ES; keep everything evaluated.

    python -m stages.refined band1 sling2sim2real

Reads data/episodes/<band>/ and data/clusters/<band>/<method>.json; writes
data/refined/<band>/<method>.parquet. Killed, it resumes from .checkpoints/. SLING_DEVICE and
SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from pathlib import Path

from pipeline import errors
from pipeline.identify.history import History
from pipeline.identify.refine import iterations, refine
from pipeline.identify.regions import load_regions
from pipeline.identify.session import session
from pipeline.sling.model import THETA
from pipeline.stage import expect, started


def main() -> None:
    params, band, method = started("band", "method")
    source = expect(Path("data/clusters", band, f"{method}.json"), f"clusters@{band}-{method}")
    regions = load_regions(source)
    batches = iterations(params.optimizer, len(regions))
    history = History(method, THETA)
    with session("refined", band, method, params, batches) as evaluate:
        refine(evaluate, regions, params.optimizer, history)
        history.save(Path("data/refined", band, f"{method}.parquet"))


if __name__ == "__main__":
    errors.run(main)
