"""The card beside an exported model: README.md and card.json."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sling2sim2real.base.template import filled
from sling2sim2real.exporting import values as export_values
from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.exporting.chain import MATCHED
from sling2sim2real.exporting.match import HOLD_LIMIT, LANDING_LIMIT, DrawCompared
from sling2sim2real.exporting.proof import Matched
from sling2sim2real.quantities import QUANTITIES, rounded

UNITS = {"hold_force": "n", "speed": "m_s", "landing": "m"}  # in names of keys
ASKED = (
    f"On three draws that took no part in the match: hold force within {100 * HOLD_LIMIT:g} %,"
    f" landing within {100 * LANDING_LIMIT:g} % of the calibrated simulation."
)


def content(model: CalibratedBand, done: Matched, target: str, files: dict[str, str]) -> dict:
    """What card.json holds."""
    chain = done.chain
    return {
        "band": model.band.name,
        "target": target,
        "files": files,
        "frames": export_values.FRAMES,
        "sizes": export_values.sizes(model),
        "law": model.parameters.law,
        "history": export_values.history(model),
        "values": export_values.values(model),
        "matched": [
            {"name": name, "value": rounded(value, 6), "unit": MATCHED[name]}
            for name, value in chain.matched.items()
        ],
        "springs_error": rounded(chain.cubic_springs()[3]),
        "upturn": rounded(chain.upturn),
        "largest_stretch": rounded(1 + chain.largest_strain, 4),
        "time_step_s": chain.step,
        "time_step_error": rounded(done.finer),
        "edges": chain.edges,
        "engine": done.engine,
        "asked": ASKED,
        "met": done.met,
        "proof": list(map(compared_row, done.proof)),
        "match": list(map(compared_row, done.match)),
        "without_slot": export_values.without_slot(model),
    }


def compared_row(compared: DrawCompared) -> dict:
    """A draw as card.json has it: both engines' values, relative errors; None: it is lost."""
    row: dict[str, float | None] = {
        "draw_y_m": rounded(compared.draw[0], 6),
        "draw_z_m": rounded(compared.draw[1], 6),
    }
    for name, error in compared.errors.items():
        ours, theirs = getattr(compared, name)
        row[f"{name}_{UNITS[name]}"] = rounded(ours, 4)
        lost = not np.isfinite(theirs)
        row[f"{name}_there_{UNITS[name]}"] = None if lost else rounded(theirs, 4)
        row[f"{name}_error"] = None if lost else round(error, 4)
    return row


def readme(content: dict, **more: object) -> str:
    """README.md, by the template of the target; `more` is what card.json does not hold."""
    identified = {row["name"]: row["value"] for row in content["values"]}
    named = {"identified": identified, "quantities": QUANTITIES, "units": UNITS}
    template = Path(__file__).with_name(f"{content['target']}.md.j2")
    return filled(template, **content, **named, **more)
