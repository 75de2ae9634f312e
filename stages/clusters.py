"""Find the promising regions of a history and their covariances.

    python -m stages.clusters band1 sling2sim2real

Reads data/history/<band>/<method>.parquet; writes data/clusters/<band>/<method>.json.
"""

from __future__ import annotations

from pathlib import Path

from pipeline import errors
from pipeline.identify.history import History
from pipeline.identify.regions import find_regions, save_regions
from pipeline.sling.model import THETA
from pipeline.stage import expect, started


def main() -> None:
    params, band, method = started("band", "method")
    optimizer = params.optimizer
    source = expect(Path("data/history", band, f"{method}.parquet"), f"history@{band}-{method}")
    history = History.load(method, THETA, source)
    regions = find_regions(
        history.unit,
        history.total,
        k_top=optimizer.k_top,
        k_nn=optimizer.k_nn,
        delta=optimizer.delta,
    )
    save_regions(Path("data/clusters", band, f"{method}.json"), THETA, regions, optimizer.k_top)
    fewer = f" (k_top asks for {optimizer.k_top})" if len(regions) < optimizer.k_top else ""
    print(f"{band} {method}: {len(regions)} regions{fewer}, best loss {regions[0].loss:.5g}")


if __name__ == "__main__":
    errors.run(main)
