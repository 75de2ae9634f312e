"""Find the promising regions of a history and refine each by CMA-ES; keep everything evaluated.

    python -m stages.refined band1 sling2sim2real

Reads data/episodes/<band>/ and data/history/<band>/<method>.parquet; writes the regions with their
covariances to data/clusters/<band>/<method>.json and what was evaluated to
data/refined/<band>/<method>.parquet. Where the method's search has one phase, the one holds no
region and the other no row. Killed, it resumes from .checkpoints/. SLING_DEVICE and SLING_WORKERS
say where it runs.
"""

from __future__ import annotations

from pipeline.base.layout import Layout, made
from pipeline.objective.session import service
from pipeline.objective.space import Space
from pipeline.search.history import History
from pipeline.search.loop import Free, search
from pipeline.search.optimizers.multistart import Multistart
from pipeline.search.regions import Region, regions_of, save_regions
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    about, optimizer, layout = params.methods[method], params.optimizer, Layout()
    space = Space.of_method(params, method)
    free = Free.of(space, about.fixed)
    explored = History.load(method, free.names, made(layout.history(band, method)))
    regions, asked = promising(about, optimizer, explored)
    save_regions(layout.clusters(band, method), free.names, regions, asked)
    history = History(method, space.names)
    if regions:
        fewer = f" (k_top asks for {asked})" if len(regions) < asked else ""
        best = f"best loss {regions[0].loss:.5g}"
        print(f"{band} {method}: {len(regions)} regions{fewer}, {best}", flush=True)
        search(
            Multistart(regions, population=optimizer.cma_population, seed=optimizer.seed),
            service("refined", band, method, params, optimizer.cma_rollouts),
            history,
            rollouts=optimizer.cma_rollouts,
            free=free,
        )
    else:
        print(f"{band} {method}: {about.search} has no second phase")
    history.save(layout.refined(band, method))


def promising(about, optimizer, explored: History) -> tuple[list[Region], int]:
    """Regions of a history and how many were asked for; none where the search has one phase."""
    if about.search != "multistart":
        return [], 0
    explored.best()  # says why, where all failed
    return regions_of(about, optimizer, explored)


if __name__ == "__main__":
    run(main)
