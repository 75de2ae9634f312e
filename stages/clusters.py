"""Choose the distinct regions of an exploration, with their covariances.

    python -m stages.clusters band1 sling2sim2real

Reads data/history/<band>/<method>.parquet; writes data/clusters/<band>/<method>.json. A CMA-ES will
start in each region.
"""

from __future__ import annotations

from sling2sim2real.base.layout import Layout, made
from sling2sim2real.identification.evaluations import Evaluations
from sling2sim2real.identification.searches.regions import regions_of, save_regions
from sling2sim2real.settings.identification import parameter_names
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    method_params, layout = params.methods[method], Layout()
    names = tuple(
        name for name in parameter_names(method_params.law) if name not in method_params.fixed
    )
    explored = Evaluations.load(method, names, made(layout.history(band, method)))
    explored.best_row()  # says why, where all failed
    regions, requested = regions_of(method_params, params.optimizer, explored)
    save_regions(layout.clusters(band, method), names, regions, requested)
    print(f"{band} {method}: {len(regions)} regions, best loss {regions[0].loss:.5g}")


if __name__ == "__main__":
    run(main)
