"""Choose the distinct regions of an exploration, with their covariances.

    python -m stages.clusters band1-paper

Reads data/history/<pair>.parquet; writes data/clusters/<pair>.json. A CMA-ES will start in each
region.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.base.files import made
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.searches.regions import regions_of, save_regions
from stages.start import pair_of_stage, run


def main() -> None:
    params, pair = pair_of_stage()
    method_params, layout = params.methods[pair.method], Layout()
    explored = Evaluations.load(pair.method, made(layout.history(pair)))
    explored.names = tuple(name for name in explored.names if name not in method_params.fixed)
    explored.best_row()  # says why, where all failed
    regions = regions_of(method_params, params.optimizer, explored)
    save_regions(layout.clusters(pair), explored.names, regions)
    print(f"{pair.key}: {len(regions)} regions, best loss {regions[0].loss:.5g}")


if __name__ == "__main__":
    run(main)
