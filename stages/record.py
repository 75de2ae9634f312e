"""Record one of the virtual rig's bands: data/raw/<band>/<band>.mcap.

python -m stages.record band1
"""

from __future__ import annotations

from rig.recorder.record import record
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout
from stages.start import run, started


def main() -> None:
    params, band = started("band")
    if params.bands[band].source != "rig":
        raise UserError(f"{band}: not a band with source: rig in params.yaml")
    if band not in params.rig.bands:
        raise UserError(f"{band}: rig.bands in params.yaml does not say what it is made of")
    record(params, band, Layout().recording(band), lambda line: print(line, flush=True))


if __name__ == "__main__":
    run(main)
