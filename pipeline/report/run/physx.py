"""The committed run of the paper's method in the paper's engine, on bands of the rig.

What it is and how it is made: validation/engines/physx/policy.py. It is no part of a run.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from pipeline.report.run.committed import FOLDER, committed

NAME, WRITER = "physx-policy-{}.json", "validation.engines.physx.policy"
FAILED = "did not land"


def launched(root: Path, bands: Iterable[str]) -> dict[str, pd.DataFrame]:
    """Virtual launches of policies that were searched and trained in PhysX, by the bands with some.

    Returns:
        Columns `target` and `landing_y` [m], and `failure`. Raises UserError for another's file.
    """
    result = {}
    for band in bands:
        pairs = committed(root / FOLDER / NAME.format(band), WRITER, _landings)
        if pairs is None:
            continue
        trials = pd.DataFrame(pairs, columns=["target", "landing_y"]).astype(float)
        failure = trials.landing_y.map(lambda landing: None if landing == landing else FAILED)
        result[band] = trials.assign(failure=failure.astype(object))
    return result


def _landings(content: dict) -> list[tuple[float, float | None]]:
    rows = content["targets"]
    return [(of["target_m"], landing) for of in rows for landing in of["on_rig_m"]]
