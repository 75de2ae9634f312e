"""What `sling check` says of a recording: the same content as text and as JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from tabulate import tabulate

from sling2sim2real.base.errors import printable
from sling2sim2real.cli.preflight.facts import Facts
from sling2sim2real.recording.checks import Finding
from sling2sim2real.recording.clouds import PhaseLine, PictureLine

MOST_PHASES = 9  # in a line


@dataclass(frozen=True)
class Topic:
    """One line of the table; times in seconds, None where the topic plays no role.

    Attributes:
        role: Or several, with commas between them.
        why: How it was chosen for its role.
        delay: Median of log_time - header.stamp.
        clock_offset: By how much its stamps are ahead of the force's, by the times of receipt.
        missing: Messages that a constant rate would have had in the gaps.
        lost: Damaged, not finite or doubled messages.
        notes: What was repaired or lost, in words.
    """

    topic: str
    type: str
    messages: int
    role: str | None = None
    why: str | None = None
    rate: float | None = None
    longest_gap: float | None = None
    missing: int | None = None
    lost: int | None = None
    delay: float | None = None
    clock_offset: float | None = None
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class PullLine:
    """One pull of a file in a line; numbers are None where they could not be determined.

    Attributes:
        number: From 1 on, by time.
        grasp_s, release_s: Since the file's first force.
        usable, verdict: As of a report.
        cautions: How many.
    """

    number: int
    grasp_s: float | None
    release_s: float | None
    peak_force_n: float | None
    usable: bool
    verdict: str
    cautions: int


@dataclass
class CheckReport:
    """Everything `sling check` says of a pull; `problem` is None where it can be used.

    Attributes:
        losses: What was lost of the file and its topics or mended in them, in words.
        notes: What else to know of it, which cost nothing.
        band: Its sizes, where they come from, and its mass; None where that is not known.
        frames: Where each transform comes from.
        signals, delays, cloud, extrinsics: As of `facts`; empty where the pull is not understood.
        phases, coverage: Of the pictures.
        motion: What the hand does with the drawn band, by time.
        keeps_prior: What that does not show, and so nothing but a prior tells, by what is missing.
        cautions: What costs accuracy, and what to do.
        written: Files that were drawn of it, in words.
        pull: Which of the file's pulls it is about, from 1 on.
        pulls: All of them.
    """

    path: str
    sha256: str
    problem: str | None
    losses: list[str]
    topics: list[Topic]
    notes: list[str] = field(default_factory=list)
    band: Facts = field(kw_only=True)
    frames: dict[str, str] = field(default_factory=dict)
    signals: Facts = field(default_factory=dict)
    delays: dict[str, Facts] = field(default_factory=dict)
    cloud: Facts = field(default_factory=dict)
    phases: list[PhaseLine] = field(default_factory=list)
    coverage: list[PictureLine] = field(default_factory=list)
    motion: list[Facts] = field(default_factory=list)
    keeps_prior: dict[str, str] = field(default_factory=dict)
    extrinsics: Facts = field(default_factory=dict)
    cautions: list[Finding] = field(default_factory=list)
    written: list[str] = field(default_factory=list)
    pull: int = 1
    pulls: list[PullLine] = field(default_factory=list)

    @property
    def row(self) -> PullLine:
        """This pull in a line."""
        known, remarks = self.signals.get, len(self.cautions)
        times = known("grasp_s"), known("release_s")
        peak = known("peak_force_n")
        return PullLine(self.pull, *times, peak, self.usable, self.verdict, remarks)

    @property
    def usable(self) -> bool:
        return self.problem is None

    @property
    def verdict(self) -> str:
        if not self.usable:
            return f"cannot be used: {self.problem}"
        return "can be used, but:" if self.cautions else "can be used"

    def to_json(self, frames: bool = False) -> str:
        """Write the report as one object; `frames` adds `coverage`, a row for each picture."""
        content = {**asdict(self), "usable": self.usable, "verdict": self.verdict}
        content["cautions"] = [caution.content() for caution in self.cautions]
        if not frames:
            del content["coverage"]
        return json.dumps(content, indent=2, allow_nan=False)

    def to_text(self) -> str:
        """The verdict, what it rests on, and then everything else; names may be of any letters."""
        lines = [f"{self.path}  sha256 {self.sha256[:16]}", "", *self._verdict(), *self._basis()]
        lines += ["", *self.written] if self.written else []
        lines += [f"lost or mended: {loss}" for loss in self.losses]
        lines += [f"note: {note}" for note in self.notes]
        lines += _phases(self.phases) + _extrinsics(self.extrinsics) + _delays(self.delays)
        for title in ("band", "signals", "cloud", "frames"):
            known = {name: v for name, v in getattr(self, title).items() if v is not None}
            if known:
                lines += ["", title, *(f"  {name:<22}{_shown(v)}" for name, v in known.items())]
        return "\n".join(map(printable, [*lines, "", *_topics(self.topics)]))

    def _basis(self) -> list[str]:
        """The numbers that tell most, in words."""
        lines, seen = [], self.cloud
        if signals := self.signals:
            lines += [
                f"  force: at most {signals['peak_force_n']:.1f} N,"
                f" at {signals['stretch']:.2f} times the rest length;"
                f" release known to ± {1e3 * signals['release_error_s']:.1f} ms"
            ]
        if self.motion:
            lines.append(f"  motion: {_motion(self.motion)}")
        if self.keeps_prior:
            retained = (f"{keeps} ({what})" for what, keeps in self.keeps_prior.items())
            lines.append(f"  not in it, so known by a prior alone: {'; '.join(retained)}")
        if seen:
            covered = seen["taut_coverage"]
            part = "" if covered is None else f", {100 * covered:.0f} % of it while it is drawn"
            shown = seen["frames"] - seen["empty"]
            lines += [f"  pictures: the band is in {shown} of {seen['frames']}{part}"]
        if "assumed" in self.band["source"]:
            lines += [
                f"  the band: {self.band['diameter_m']:g} m thick and"
                f" {self.band['rest_length_m']:g} m long, {self.band['source']}"
            ]
        if self.band["mass_kg"] is None:
            lines.append(
                "  no mass given, so its weight and the force's direction are not judged: --mass"
            )
        return ["", "it rests on", *lines] if lines else []

    def _verdict(self) -> list[str]:
        cautions = [f"  - {caution}" for caution in self.cautions]
        if len(self.pulls) <= 1:
            return [self.verdict, *cautions]
        rows = [
            (row.number, row.grasp_s, row.release_s, row.peak_force_n, row.verdict, row.cautions)
            for row in self.pulls
        ]
        heads = "pull", "grasp [s]", "release [s]", "peak [N]", "verdict", "remarks"
        line = f"pull {self.pull} of {len(self.pulls)}: {self.verdict}"
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


def _topics(topics: list[Topic]) -> list[str]:
    """What the file holds, and the choice as YAML that a band's settings can hold."""

    def milliseconds(seconds: float | None, form: str = "+.1f") -> str | None:
        return None if seconds is None else f"{1e3 * seconds:{form}} ms"

    cells = [
        (
            row.topic,
            row.role,
            row.messages,
            None if row.rate is None else f"{row.rate:.1f} Hz",
            milliseconds(row.longest_gap, ".1f"),
            row.missing,
            row.lost,
            milliseconds(row.delay),
            milliseconds(row.clock_offset),
        )
        for row in topics
    ]
    heads = "topic", "role", "messages", "rate", "longest gap", "missing", "lost", "delay", "clock"
    rows, chosen = _table(cells, heads), []
    for row in topics:
        name = row.topic if re.fullmatch(r"[/\w.-]+", row.topic) else json.dumps(row.topic)
        for role in row.role.split(", ") if row.role else ():
            chosen.append(f"      {role}: {name}  # {row.type}: {row.why}")
    if chosen:
        rows += ["", "chosen (to keep it, or another one: in band.yaml)"]
        rows += ["settings:", "  setup:", "    topics:", *chosen]
    return rows


def _phases(phases: list[PhaseLine]) -> list[str]:
    heads = "mask", "seconds", "pictures", "empty", "points", "covered"
    rows = [
        (
            row.phase,
            f"{row.start:.2f} - {row.end:.2f}",
            row.pictures,
            row.empty,
            row.points,
            f"{100 * row.coverage:.0f} %",
        )
        for row in phases
    ]
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
