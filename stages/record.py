"""Record one of the virtual rig's bands: data/raw/<band>.mcap.

python -m stages.record band1
"""

from __future__ import annotations

from pathlib import Path

from pipeline.base.errors import UserError, run
from pipeline.rig.recorder.record import record
from stages.start import started


def main() -> None:
    params, band = started("band")
    if params.bands[band].source != "rig":
        raise UserError(f"{band}: not a band with source: rig in params.yaml")
    if band not in params.rig.bands:
        raise UserError(f"{band}: rig.bands in params.yaml does not say what it is made of")
    record(params, band, Path(f"data/raw/{band}.mcap"), lambda line: print(line, flush=True))


if __name__ == "__main__":
    run(main)
