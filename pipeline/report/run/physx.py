"""The committed run of the paper's method in the paper's engine, on bands of the rig.

What it is and how it is made: validation/engines/physx/policy.py. It is no part of a run.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from pipeline.base.errors import UserError

FOLDER, NAME = Path("reports", "validation"), "physx-policy-{}.json"
FAILED = "did not land"


def launched(root: Path, bands: Iterable[str]) -> dict[str, pd.DataFrame]:
    """Virtual launches of policies that were searched and trained in PhysX, by the bands with some.

    Returns:
        Columns `target` and `landing_y` [m], and `failure`. Raises UserError for another's file.
    """
    result = {}
    for band in bands:
        path = root / FOLDER / NAME.format(band)
        if not path.exists():
            continue
        try:
            targets = json.loads(path.read_text(encoding="utf-8"))["targets"]
            pairs = [(of["target_m"], landing) for of in targets for landing in of["on_rig_m"]]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise UserError(
                f"{path}: is not what validation.engines.physx.policy writes ({error!r});"
                " `git checkout` it"
            ) from error
        trials = pd.DataFrame(pairs, columns=["target", "landing_y"]).astype(float)
        failure = trials.landing_y.map(lambda landing: None if landing == landing else FAILED)
        result[band] = trials.assign(failure=failure.astype(object))
    return result
