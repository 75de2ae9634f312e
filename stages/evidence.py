"""Check the launches that a user measured of a band: those that are evidence, and those that score.

    python -m stages.evidence band1

Reads data/evidence/<band>.csv and data/trials/measured/<band>.csv, where they are; writes
data/launches/<band>/observed.json and scores.json, always: without launches they are empty. Only
where there are launches does observed.json say how the lab launches, for the density to read.
"""

from __future__ import annotations

from sling2sim2real.base.launch_table import expect_apart
from sling2sim2real.base.layout import Layout
from sling2sim2real.identification.posterior.evidence import read_evidence, save_observed
from sling2sim2real.launching.trials.measured import read_scores, save_scores
from stages.start import run, started


def main() -> None:
    params, band = started("band")
    layout = Layout()
    expect_apart(layout, band)
    observed = read_evidence(layout.evidence, band, params)
    scores = read_scores(layout.measured, band, params)
    save_observed(layout.observed(band), observed, params)
    save_scores(layout.scores(band), scores)
    print(f"{band}: {len(observed)} launches are evidence, {len(scores)} are scores")


if __name__ == "__main__":
    run(main)
