"""Record one of the virtual rig's bands: data/raw/<band>.mcap.

python -m stages.record band1
"""

from __future__ import annotations

import argparse
from pathlib import Path

from pipeline.errors import UserError, run
from pipeline.params import load
from pipeline.rig.record import record


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("band")
    band = parser.parse_args().band
    params = load()
    if band not in params.bands or params.bands[band].source != "rig":
        raise UserError(f"{band}: not a band with source: rig in params.yaml")
    if band not in params.rig.bands:
        raise UserError(f"{band}: rig.bands in params.yaml does not say what it is made of")
    record(params, band, Path(f"data/raw/{band}.mcap"), lambda line: print(line, flush=True))


if __name__ == "__main__":
    run(main)
