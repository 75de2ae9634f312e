"""Explore the whole box of parameters; keep everything evaluated.

    python -m stages.history band1 sling2sim2real

By differential evolution for a multistart, by one design for the density, which is fitted from its
best point. Reads data/episodes/<band>/ and data/clamps/<band>.json; writes
data/history/<band>/<method>.parquet. Killed, it begins anew. SLING_DEVICE and
SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from sling2sim2real.base.layout import Layout
from sling2sim2real.identification.objective.session import logging_evaluator
from sling2sim2real.identification.search import explore, rollouts_of
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    rollouts = rollouts_of(params, method)
    explored = explore(params, method, logging_evaluator("history", band, method, params, rollouts))
    explored.save(Layout().history(band, method))


if __name__ == "__main__":
    run(main)
