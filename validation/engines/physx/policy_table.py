"""The table of docs/simulator.md: how far policies of PhysX miss, there, here and in their world.

    python -m validation.engines.physx.policy_table          # exit status 1 if it is out of date
    python -m validation.engines.physx.policy_table --fix

Filled from reports/validation/physx-policy-<band>.json (policy.py).
"""

from __future__ import annotations

import sys

import numpy as np

from pipeline.base.code import ROOT
from validation import orange
from validation.campaigns.runner import read
from validation.engines.physx.policy import REPORT
from validation.marked import block_of, compared_or_fixed, row, with_block

PAGE = ROOT / "docs" / "simulator.md"
BANDS = ("band1", orange.NAME)
COLUMNS = "| | in PhysX | in our simulator, same θ | in the band's own world |"


def block(reports: dict[str, dict]) -> str:
    """What the page has between its marks, of reports by band."""
    rows = []
    for band, report in reports.items():
        errors = report["errors"]
        cells = [f"{100 * errors[of]['mean_error_m']:.1f} cm" for of in ("in_physx_m", "in_ours_m")]
        if rig := errors.get("on_rig_m"):
            world = f"{100 * rig['mean_error_m']:.1f} cm, {rig['launches']} launches on the rig"
            rows.append(row(f"`{band}` (virtual)", *cells, world))
            continue
        off = [100 * (of["measured_m"] - of["in_physx_m"]) for of in report["measured"]]
        word = "farther" if np.mean(off) > 0 else "nearer"
        world = f"{len(off)} measured draws land {abs(np.mean(off)):.0f} cm {word} than in PhysX"
        rows.append(row(f"`{band}`", *cells, world))
    return block_of("policies in PhysX", [COLUMNS, "|---|---:|---:|---:|", *rows])


def drawn(page: str) -> str:
    return with_block(page, block({band: read(ROOT / REPORT.format(band)) for band in BANDS}))


if __name__ == "__main__":
    sys.exit(compared_or_fixed(PAGE, drawn, __doc__))
