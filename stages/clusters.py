"""Find the promising regions of a history and their covariances.

    python -m stages.clusters band1 sling2sim2real

Reads data/history/<band>/<method>.parquet; writes data/clusters/<band>/<method>.json, which holds
no region where the method's search has one phase.
"""

from __future__ import annotations

from pipeline.base.layout import Layout, made
from pipeline.objective.space import Space
from pipeline.search.history import History
from pipeline.search.loop import Free
from pipeline.search.regions import regions_of, save_regions
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    about, optimizer = params.methods[method], params.optimizer
    free = Free.of(Space.of_method(params, method), about.fixed)
    layout = Layout()
    history = History.load(method, free.names, made(layout.history(band, method)))
    target = layout.clusters(band, method)
    if about.search != "multistart":
        save_regions(target, free.names, [], 0)
        print(f"{band} {method}: {about.search} has no second phase")
        return
    history.best()  # says why, where all failed
    regions, asked = regions_of(about, optimizer, history)
    save_regions(target, free.names, regions, asked)
    fewer = f" (k_top asks for {asked})" if len(regions) < asked else ""
    print(f"{band} {method}: {len(regions)} regions{fewer}, best loss {regions[0].loss:.5g}")


if __name__ == "__main__":
    run(main)
