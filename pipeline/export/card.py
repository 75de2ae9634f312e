"""The card beside an exported model: README.md and card.json."""

from __future__ import annotations

from dataclasses import asdict

from pipeline.export import values as about
from pipeline.export.band import CalibratedBand
from pipeline.export.chain import MATCHED
from pipeline.export.match import HOLD, LANDING, DrawCompared
from pipeline.export.proof import Matched
from pipeline.report.quantities import QUANTITIES, rounded

UNITS = {"hold_force": "n", "speed": "m_s", "landing": "m"}  # in names of keys
ASKED = (
    f"On three draws that took no part in the match: hold force within {100 * HOLD:g} %, landing"
    f" within {100 * LANDING:g} % of the calibrated simulation."
)


def content(model: CalibratedBand, done: Matched, target: str, files: dict[str, str]) -> dict:
    """What card.json holds."""
    chain = done.chain
    return {
        "band": model.band.name,
        "target": target,
        "files": files,
        "frames": about.FRAMES,
        "sizes": about.sizes(model),
        "law": model.parameters.law,
        "history": about.history(model),
        "values": about.values(model),
        "matched": [
            {"name": name, "value": rounded(value, 6), "unit": MATCHED[name]}
            for name, value in chain.matched.items()
        ],
        "springs_error": rounded(chain.cubic_springs()[3]),
        "largest_stretch": rounded(1 + chain.largest_strain, 4),
        "time_step_s": chain.step,
        "time_step_error": rounded(done.finer),
        "edges": chain.edges,
        "engine": done.engine,
        "asked": ASKED,
        "met": done.met,
        "proof": list(map(_row, done.proof)),
        "match": list(map(_row, done.match)),
        "pull": {
            name: value if value is None else rounded(value)
            for name, value in asdict(done.pull).items()
        },
        "without_slot": about.without_slot(model),
    }


def _row(one: DrawCompared) -> dict:
    row = {"draw_y_m": rounded(one.draw[0], 6), "draw_z_m": rounded(one.draw[1], 6)}
    for name, error in one.errors.items():
        ours, theirs = getattr(one, name)
        row[f"{name}_{UNITS[name]}"] = rounded(ours, 4)
        row[f"{name}_there_{UNITS[name]}"] = rounded(theirs, 4)
        row[f"{name}_error"] = round(error, 4)
    return row


def readme(card: dict, how: str) -> str:
    """README.md.

    Args:
        how: The chapter on how to use the files.
    """
    worst = {
        name: max(abs(row[f"{name}_error"]) for row in card["proof"])
        for name in ("hold_force", "landing")
    }
    verdict = "It is met" if card["met"] else "**It is not met**"
    pull, history = card["pull"], card["history"]
    taut = pull["taut_rms"]
    taut = "" if taut is None else f"{1e3 * taut:.1f} mm (rms) while the band is taut, "
    wait = ""
    if history:
        wait = (
            "\nThe springs hold what the band holds after a pull of"
            f" {history['pull_time_s']:.1f} s and a pause of {history['pause_s']:.1f} s."
        )
    return f"""\
# {card["band"]} for {card["engine"].split()[0]}

{card["asked"]}
{verdict}: {100 * worst["hold_force"]:.1f} and {100 * worst["landing"]:.1f} % at worst
({card["engine"]}).

The calibrated simulation is the one that was identified from recordings; how far it is from the
band itself, the band's own card says.

{how}

## Values that were identified

{_table("| parameter | value | 90 % interval |", map(_value, card["values"]))}

## Matched parameters

{_matched(card)}

## What the match leaves

Proof: draws that took no part, flown to the floor.

{_compared(card["proof"])}

Match: draws of the box that land around the targets.

{_compared(card["match"])}

The pull of the recording, while the hand holds:

- The **force** differs by {pull["force_rms"]:.2f} N (rms) and at most {pull["force_largest"]:.2f} N
  of {pull["peak"]:.1f} N; by {100 * pull["hold"]:+.1f} % at the release.
- The **centre line** differs by {taut}{1e3 * pull["line_rms"]:.1f} mm over the whole pull
  and {1e3 * pull["line_largest"]:.0f} mm in the worst picture.
{wait}

## What it does not express

{_table("| parameter | value | what stands in for it |", map(_missing, card["without_slot"]))}

## Units and frames

{card["frames"]}
"""


def _table(head: str, rows) -> str:
    return "\n".join([head, "|---" * (head.count("|") - 1) + "|", *rows])


def _value(row: dict) -> str:
    quantity = QUANTITIES[row["name"]]
    shown = [quantity.factor * row[key] if row[key] is not None else None for key in _ENDS]
    value, low, high = (one if one is None else f"{one:.3g}" for one in shown)
    between = "fixed" if low is None else f"{low} – {high}"
    return f"| {quantity.label} (`{row['name']}`) | {value} {quantity.unit} | {between} |"


_ENDS = "value", "low", "high"


def _matched(card: dict) -> str:
    by_name = {row["name"]: row for row in card["matched"]}
    strength, share, damping = (by_name[name]["value"] for name in MATCHED)
    return f"""\
{card["edges"]} springs between point masses. At a strain e = length / rest length − 1 > 0, with
λ = 1 + e, a spring pulls by K/3 (λ − λ⁻²)(1 − m + m/λ); it never pushes. Its damping is K τ de/dt.

- K = {strength:.4g} N, m = {share:.3g}, τ = {1e3 * damping:.3g} ms.
- Matched up to a stretch of {card["largest_stretch"]:.2f}. Beyond, nothing is known."""


def _compared(rows: list[dict]) -> str:
    return _table(
        "| draw y, z [m] | hold force [N] | | speed [m/s] | | landing [m] | |",
        (f"| {row['draw_y_m']:.3f}, {row['draw_z_m']:.3f} {_pairs(row)} |" for row in rows),
    )


def _pairs(row: dict) -> str:
    """Our values and how far the target's are off."""
    return "".join(
        f"| {row[f'{name}_{unit}']:.2f} | {100 * row[f'{name}_error']:+.1f} % "
        for name, unit in UNITS.items()
    ).rstrip()


def _missing(row: dict) -> str:
    return f"| {row['name']} | {row['value']} | {row['instead']} |"
