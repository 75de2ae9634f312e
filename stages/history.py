"""Search the whole box of parameters; keep everything evaluated.

    python -m stages.history band1 sling2sim2real

The search is that of the method; of a multistart it is differential evolution, which the regions
and their refinement follow. Reads data/episodes/<band>/; writes
data/history/<band>/<method>.parquet. Killed, it resumes from .checkpoints/. SLING_DEVICE and
SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from pipeline.base.layout import Layout
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.session import service
from pipeline.identify.search.build import explorer
from pipeline.identify.search.history import History
from pipeline.identify.search.loop import budget, search
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    about = params.methods[method]
    box = SearchBox.of_method(params, method)
    rollouts, _ = budget(params.optimizer, about.search)
    history = History(method, box.names)
    search(
        explorer(about, params.optimizer, len(box.free), rollouts),
        service("history", band, method, params, rollouts),
        history,
        rollouts=rollouts,
        box=box,
    )
    history.save(Layout().history(band, method))


if __name__ == "__main__":
    run(main)
