"""Refine each promising region by CMA-ES; keep everything evaluated.

    python -m stages.refined band1 sling2sim2real

Reads data/episodes/<band>/ and data/clusters/<band>/<method>.json; writes
data/refined/<band>/<method>.parquet, which has no row where the method's search has one phase.
Killed, it resumes from .checkpoints/. SLING_DEVICE and SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from pipeline.base.layout import Layout, made
from pipeline.objective.session import service
from pipeline.objective.space import Space
from pipeline.search.history import History
from pipeline.search.loop import Free, search
from pipeline.search.optimizers.multistart import Multistart
from pipeline.search.regions import load_regions
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    about, optimizer = params.methods[method], params.optimizer
    space = Space.of_method(params, method)
    layout = Layout()
    regions = load_regions(made(layout.clusters(band, method)))
    history = History(method, space.names)
    if regions:
        search(
            Multistart(regions, population=optimizer.cma_population, seed=optimizer.seed),
            service("refined", band, method, params, optimizer.cma_rollouts),
            history,
            rollouts=optimizer.cma_rollouts,
            free=Free.of(space, about.fixed),
        )
    history.save(layout.refined(band, method))


if __name__ == "__main__":
    run(main)
