"""What `sling check` says of a recording: an object of JSON, and the same as text.

A report has `path`, `sha256`, `problem` (None where the pull can be used), `losses` (what was lost
of the file and its topics or mended in them), `notes` (what else to know of it), `topics`, `band`
(its sizes, where they come from, and its mass), and of the pull that it is about, by `facts`:
`pull` (from 1 on), `frames` (where each transform comes from), `signals`, `delays`, `cloud`,
`phases` (of the pictures), `extrinsics`, `motion` (what the hand does with the drawn band),
`keeps_prior` (what that does not show, and so nothing but a prior tells), `cautions` (what costs
accuracy, and what to do). `pulls` has all pulls in a line each, `written` what was drawn.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tabulate import tabulate

from sling2sim2real.base.errors import printable
from sling2sim2real.cli.preflight.facts import Facts
from sling2sim2real.recording.checks import Finding

MOST_PHASES = 9  # in a line
Report = Facts
LISTS = "losses", "notes", "topics", "cautions", "motion", "phases", "pulls", "written"
OBJECTS = "frames", "signals", "delays", "cloud", "extrinsics", "keeps_prior"


def new_report(path: Path, band: Facts) -> Report:
    """A report of which nothing is known yet."""
    report = {"path": str(path), "sha256": "", "problem": None, "band": band, "pull": 1}
    return report | {name: [] for name in LISTS} | {name: {} for name in OBJECTS}


def verdict_of(report: Report) -> str:
    if report["problem"] is not None:
        return f"cannot be used: {report['problem']}"
    return "can be used, but:" if report["cautions"] else "can be used"


def pull_line(report: Report) -> Facts:
    """A pull in a line; numbers are None where they could not be determined."""
    signals = report["signals"]
    return {
        "number": report["pull"],
        "grasp_s": signals.get("grasp_s"),
        "release_s": signals.get("release_s"),
        "peak_force_n": signals.get("peak_force_n"),
        "verdict": verdict_of(report),
        "cautions": len(report["cautions"]),
        "usable": report["problem"] is None,
    }


def to_json(report: Report) -> str:
    """Write the report as one object."""
    told = {"usable": report["problem"] is None, "verdict": verdict_of(report)}
    return json.dumps(report | told, indent=2, allow_nan=False)


def to_text(report: Report) -> str:
    """The verdict, what it rests on, and then everything else; names may be of any letters."""
    lines = [f"{report['path']}  sha256 {report['sha256'][:16]}", "", *_verdict(report)]
    lines += _basis(report)
    lines += ["", *report["written"]] if report["written"] else []
    lines += [f"lost or mended: {loss}" for loss in report["losses"]]
    lines += [f"note: {note}" for note in report["notes"]]
    lines += _phases(report["phases"])
    lines += _extrinsics(report["extrinsics"]) + _delays(report["delays"])
    for title in ("band", "signals", "cloud", "frames"):
        known = {name: v for name, v in report[title].items() if v is not None}
        if known:
            lines += ["", title, *(f"  {name:<22}{_shown(v)}" for name, v in known.items())]
    return "\n".join(map(printable, [*lines, "", *_topics(report["topics"])]))


def _basis(report: Report) -> list[str]:
    """The numbers that tell most, in words."""
    lines, seen, band = [], report["cloud"], report["band"]
    if signals := report["signals"]:
        lines += [
            f"  force: at most {signals['peak_force_n']:.1f} N,"
            f" at {signals['stretch']:.2f} times the rest length;"
            f" release known to ± {1e3 * signals['release_error_s']:.1f} ms"
        ]
    if report["motion"]:
        lines.append(f"  motion: {_motion(report['motion'])}")
    if report["keeps_prior"]:
        retained = (f"{keeps} ({what})" for what, keeps in report["keeps_prior"].items())
        lines.append(f"  not in it, so known by a prior alone: {'; '.join(retained)}")
    if seen:
        covered = seen["taut_coverage"]
        part = "" if covered is None else f", {100 * covered:.0f} % of it while it is drawn"
        shown = seen["frames"] - seen["empty"]
        lines += [f"  pictures: the band is in {shown} of {seen['frames']}{part}"]
    if "assumed" in band["source"]:
        sizes = f"{band['diameter_m']:g} m thick and {band['rest_length_m']:g} m long"
        lines += [f"  the band: {sizes}, {band['source']}"]
    if band["mass_kg"] is None:
        lines.append(
            "  no mass given, so its weight and the force's direction are not judged: --mass"
        )
    return ["", "it rests on", *lines] if lines else []


def _verdict(report: Report) -> list[str]:
    cautions = [f"  - {Finding(**caution)}" for caution in report["cautions"]]
    verdict, pulls = verdict_of(report), report["pulls"]
    if len(pulls) <= 1:
        return [verdict, *cautions]
    rows = [[value for name, value in pull.items() if name != "usable"] for pull in pulls]
    heads = "pull", "grasp [s]", "release [s]", "peak [N]", "verdict", "remarks"
    line = f"pull {report['pull']} of {len(pulls)}: {verdict}"
    return [line, *cautions, "", *_table(rows, heads)]


def _table(rows: Sequence[Sequence[Any]], heads: Sequence[str]) -> list[str]:
    text = tabulate(rows, heads, tablefmt="plain", floatfmt=".3f", missingval="-")
    return [line.rstrip() for line in text.splitlines()]


def _motion(phases: list[Facts]) -> str:
    """List phases in the order of time; of many, the first and the last ones."""
    words = [
        f"pause {phase['end_s'] - phase['begin_s']:.1f} s"
        if phase["kind"] == "pause"
        else f"{phase['kind']} {100 * phase['from_m']:.0f} to {100 * phase['to_m']:.0f} cm at"
        f" {phase['speed_m_s']:.2f} m/s"
        for phase in phases
    ]
    if len(words) > MOST_PHASES:
        words[MOST_PHASES - 3 : -3] = [f"{len(words) - MOST_PHASES} more"]
    return ", ".join(words)


def _topics(topics: list[Facts]) -> list[str]:
    """What the file holds, and the choice as YAML that a band's settings can hold."""

    def shown(row: Facts, name: str, form: str, factor: float = 1.0) -> str | None:
        return None if row.get(name) is None else f"{factor * row[name]:{form}}"

    cells = [
        (
            row["topic"],
            row["role"],
            row["messages"],
            shown(row, "rate", ".1f"),
            shown(row, "longest_gap", ".1f", 1e3),
            row.get("missing"),
            row.get("lost"),
            shown(row, "delay", "+.1f", 1e3),
            shown(row, "clock_offset", "+.1f", 1e3),
        )
        for row in topics
    ]
    heads = ["topic", "role", "messages", "rate [Hz]", "longest gap [ms]", "missing", "lost"]
    rows, chosen = _table(cells, [*heads, "delay [ms]", "clock [ms]"]), []
    for row in topics:
        plain = re.fullmatch(r"[/\w.-]+", row["topic"])
        name = row["topic"] if plain else json.dumps(row["topic"])
        for role in row["role"].split(", ") if row["role"] else ():
            chosen.append(f"      {role}: {name}  # {row['type']}: {row['why']}")
    if chosen:
        rows += ["", "chosen (to keep it, or another one: in band.yaml)"]
        rows += ["settings:", "  setup:", "    topics:", *chosen]
    return rows


def _phases(phases: list[Facts]) -> list[str]:
    rows = [
        (
            row["phase"],
            f"{row['start']:.2f} - {row['end']:.2f}",
            row["pictures"],
            row["empty"],
            row["points"],
            f"{100 * row['coverage']:.0f} %",
        )
        for row in phases
    ]
    heads = "mask", "seconds", "pictures", "empty", "points", "covered"
    return ["", *_table(rows, heads)] if rows else []


def _delays(delays: dict[str, Facts]) -> list[str]:
    rows = ["", "delays against the force's stamps"] if delays else []
    for role, delay in delays.items():
        value, error = delay["value_s"], delay["error_s"]
        shown = "-" if value is None else f"{round(1e3 * value, 1) + 0.0:+.1f} ms"
        shown += "" if error is None else f" ± {1e3 * error:.1f} ms"
        done = "taken out" if delay["applied"] else "left as it is"
        rows.append(f"  {role:<10}{shown}  ({delay['source']}, {done})")
    return rows


def _extrinsics(facts: Facts) -> list[str]:
    if not facts:
        return []

    def pair(name: str) -> str:
        values = zip("xyz", facts[f"{name}_m"], facts[f"{name}_error_m"], strict=True)
        return "  ".join(f"{axis} {1e3 * v:+.1f} ± {1e3 * e:.1f}" for axis, v, e in values)

    return [
        "",
        f"extrinsics, by the drawn band in {facts['pictures']} pictures (frame O)",
        f"  fork tips off  {pair('tips')} mm",
        f"  hand off       {pair('hand')} mm",
        f"  what is left   {1e3 * facts['residual_m']:.1f} mm",
    ]


def _shown(value: object) -> str:
    if isinstance(value, list):
        return " ".join(f"{number:.4f}" for number in value)
    return f"{value:.4f}" if isinstance(value, float) else str(value)
