"""The card beside an exported model: README.md and card.json."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sling2sim2real.api.model import Model
from sling2sim2real.base.template import filled
from sling2sim2real.exporting.chain import MATCHED
from sling2sim2real.exporting.match import HOLD_LIMIT, LANDING_LIMIT, DrawCompared, Matched
from sling2sim2real.quantities import QUANTITIES, rounded

UNITS = {"hold_force": "n", "speed": "m_s", "landing": "m"}  # in names of keys
ASKED = (
    f"On three draws that took no part in the match: hold force within {100 * HOLD_LIMIT:g} %,"
    f" landing within {100 * LANDING_LIMIT:g} % of the calibrated simulation."
)
FRAMES = (
    "SI units throughout. Frame O: origin midway between the fork's tips, x along the fork, y"
    " towards the target, z up. A draw is the place (y, z) to which the arm is sent with the"
    " projectile; a landing is a distance along y on the floor."
)


def identified(model: Model, target: str, files: dict[str, str]) -> dict:
    """What card.json holds of the band, whatever the target: values with their 90 % intervals."""
    intervals, theta = getattr(model, "intervals", {}), model.parameters.sample()
    values = []
    for name in (name for name in QUANTITIES if name in theta):
        ends, interval = (None, None), intervals.get(name)
        if interval is not None and interval.low < interval.high:
            ends = rounded(interval.low, 6), rounded(interval.high, 6)
        row = {"name": name, "value": rounded(theta[name], 6), "unit": QUANTITIES[name].si}
        values.append(row | dict(zip(("low", "high"), ends, strict=True)))
    return {
        "band": model.band.name,
        "target": target,
        "files": files,
        "frames": FRAMES,
        "law": model.parameters.law,
        "values": values,
    }


def content(model: Model, done: Matched, target: str, files: dict[str, str]) -> dict:
    """What card.json holds of a proven chain."""
    chain, history = done.chain, model.launch_setup.history
    times = history and {"pull_time_s": history.pull_time, "pause_s": history.pause}
    return identified(model, target, files) | {
        "history": times,
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
    values = {row["name"]: row["value"] for row in content["values"]}
    named = {"identified": values, "quantities": QUANTITIES, "units": UNITS}
    template = Path(__file__).with_name(f"{content['target']}.md.j2")
    return filled(template, **content, **named, **more)
