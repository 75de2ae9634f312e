"""Choose θ*: the best of everything that exploration and refinement evaluated.

    python -m stages.theta band1 sling2sim2real

Reads data/history/ and data/refined/<band>/<method>.parquet; writes
data/theta/<band>/<method>.json.
"""

from __future__ import annotations

from pathlib import Path

from pipeline import errors
from pipeline.files import write_json
from pipeline.identify.history import History, theta_content
from pipeline.sling.model import THETA
from pipeline.stage import expect, started


def main() -> None:
    _, band, method = started("band", "method")
    sources = [
        expect(Path("data", phase, band, f"{method}.parquet"), f"{phase}@{band}-{method}")
        for phase in ("history", "refined")
    ]
    content = theta_content(History.load(method, THETA, *sources), band)
    write_json(Path("data/theta", band, f"{method}.json"), content)
    values = ", ".join(f"{name} {value:.4g}" for name, value in content["theta"].items())
    print(f"{band} {method}: {values}; loss {content['loss']['total']:.5g}")


if __name__ == "__main__":
    errors.run(main)
