"""Launch on the virtual rig with the policy of one band and method.

    python -m stages.launches band1 sling2sim2real

Reads the policy in data/policies/<band>/<method>/, and writes launches.parquet beside it: launches
of equal target and number have the same errors, for every method and policy.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from pipeline.params import load
from rig.physics.launch import Trial, launch
from sling2sim2real.base.layout import Layout
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials import trials
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    targets = np.repeat(params.trials.targets, params.trials.repeats).tolist()
    aimed = trials.aimed(Stored(band, method), targets)
    launched = trials.launch_virtually(aimed, partial(_launch, band))
    launched.save(Layout().launches(band, method))
    landed = sum(landing is not None for landing in launched.every("landing"))
    print(f"{band} {method}: {landed} of {len(targets)} launches landed on the rig")


def _launch(band: str, draw: np.ndarray, number: int) -> Trial:
    """A launch in a process of its own, which reads the parameters: they cannot be sent there."""
    return launch(band, load(), draw, number)


if __name__ == "__main__":
    run(main)
