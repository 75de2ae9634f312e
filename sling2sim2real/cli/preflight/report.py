"""What `sling check` says of a recording: the same content as text and as JSON."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass, field

from sling2sim2real.base.errors import printable
from sling2sim2real.cli.preflight.facts import (
    BandFacts,
    CloudFacts,
    DelayFacts,
    ExtrinsicFacts,
    MotionPhase,
    SignalSummary,
)
from sling2sim2real.recording.checks import Finding
from sling2sim2real.recording.clouds import PhaseLine, PictureLine

MOST_PHASES = 9  # in a line


@dataclass(frozen=True)
class Topic:
    """One line of the table; times in seconds, None where the topic plays no role: see `Chosen`.

    Attributes:
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
class Chosen(Topic):
    """One that plays a role, or several: nothing of it is None."""

    role: str = ""
    why: str = ""
    rate: float = 0.0
    longest_gap: float = 0.0
    missing: int = 0
    lost: int = 0
    delay: float = 0.0
    clock_offset: float = 0.0


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

    def __str__(self) -> str:
        numbers = (self.grasp_s, self.release_s, self.peak_force_n)
        cells = "".join(f"{'-' if n is None else format(n, '.3f'):>13}" for n in numbers)
        remarks = f" {self.cautions} remark{'s' * (self.cautions > 1)}" if self.cautions else ""
        return f"{self.number:>6}{cells}   {self.verdict}{remarks}"


@dataclass
class CheckReport:
    """Everything `sling check` says of a pull; `problem` is None where it can be used.

    Attributes:
        pull: Which of the file's pulls it is about, from 1 on.
        pulls: All of them.
        losses: What was lost of the file and its topics or mended in them, in words.
        notes: What else to know of it, which cost nothing.
        frames: Where each transform comes from.
        signals, delays, cloud, phases, coverage: None and empty where the pull is not understood.
        motion: What the hand does with the drawn band, by time.
        keeps_prior: What that does not show, and so nothing but a prior tells, by what is missing.
        extrinsics: None where it cannot be determined.
        cautions: What costs accuracy, and what to do.
        written: Files that were drawn of it, in words.
    """

    path: str
    sha256: str
    problem: str | None
    losses: list[str]
    topics: list[Topic]
    notes: list[str] = field(default_factory=list)
    band: BandFacts = field(kw_only=True)
    frames: dict[str, str] = field(default_factory=dict)
    signals: SignalSummary | None = None
    delays: dict[str, DelayFacts] = field(default_factory=dict)
    cloud: CloudFacts | None = None
    phases: list[PhaseLine] = field(default_factory=list)
    coverage: list[PictureLine] = field(default_factory=list)
    motion: list[MotionPhase] = field(default_factory=list)
    keeps_prior: dict[str, str] = field(default_factory=dict)
    extrinsics: ExtrinsicFacts | None = None
    cautions: list[Finding] = field(default_factory=list)
    written: list[str] = field(default_factory=list)
    pull: int = 1
    pulls: list[PullLine] = field(default_factory=list)

    @property
    def row(self) -> PullLine:
        """This pull in a line."""
        text, numbers = self.signals, (None, None, None)
        if text:
            numbers = text.grasp_s, text.release_s, text.peak_force_n
        return PullLine(self.pull, *numbers, self.usable, self.verdict, len(self.cautions))

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
        content |= {name: content[name] or {} for name in ("signals", "cloud", "extrinsics")}
        if not frames:
            del content["coverage"]
        return json.dumps(content, indent=2, allow_nan=False)

    def to_text(self) -> str:
        """The verdict, what it rests on, and then everything else; names may be of any letters."""
        lines = [f"{self.path}  sha256 {self.sha256[:16]}", "", *self._verdict()]
        lines += self._basis()
        lines += ["", *self.written] if self.written else []
        lines += [f"lost or mended: {loss}" for loss in self.losses]
        lines += [f"note: {note}" for note in self.notes]
        lines += _phases(self.phases) + _extrinsics(self.extrinsics) + _delays(self.delays)
        content = asdict(self)
        for title in ("band", "signals", "cloud", "frames"):
            if facts := content[title]:
                lines += [
                    "",
                    title,
                    *(f"  {k:<22}{_shown(v)}" for k, v in facts.items() if v is not None),
                ]
        return "\n".join(map(printable, [*lines, "", *_topics(self.topics)]))

    def _basis(self) -> list[str]:
        """The numbers that tell most, in words."""
        lines, text, seen = [], self.signals, self.cloud
        if text:
            lines += [
                f"  force: at most {text.peak_force_n:.1f} N, at {text.stretch:.2f} times the"
                f" rest length; release known to ± {1e3 * text.release_error_s:.1f} ms"
            ]
        if self.motion:
            lines.append(f"  motion: {_motion(self.motion)}")
        if self.keeps_prior:
            retained = (f"{keeps} ({what})" for what, keeps in self.keeps_prior.items())
            lines.append(f"  not in it, so known by a prior alone: {'; '.join(retained)}")
        if seen:
            shown = seen.frames - seen.empty
            covered = seen.taut_coverage
            part = "" if covered is None else f", {100 * covered:.0f} % of it while it is drawn"
            lines += [f"  pictures: the band is in {shown} of {seen.frames}{part}"]
        if "assumed" in self.band.source:
            lines += [
                f"  the band: {self.band.diameter_m:g} m thick and"
                f" {self.band.rest_length_m:g} m long, {self.band.source}"
            ]
        if self.band.mass_kg is None:
            lines.append(
                "  no mass given, so its weight and the force's direction are not judged: --mass"
            )
        return ["", "it rests on", *lines] if lines else []

    def _verdict(self) -> list[str]:
        cautions = [f"  - {caution}" for caution in self.cautions]
        if len(self.pulls) <= 1:
            return [self.verdict, *cautions]
        heads = "".join(f"{name:>13}" for name in ("grasp [s]", "release [s]", "peak [N]"))
        line = f"pull {self.pull} of {len(self.pulls)}: {self.verdict}"
        return [line, *cautions, "", f"{'pull':>6}{heads}", *map(str, self.pulls)]


def _motion(phases: list[MotionPhase]) -> str:
    """List phases in the order of time; of many, the first and the last ones."""
    text = list(map(str, phases))
    if len(text) > MOST_PHASES:
        left = len(text) - MOST_PHASES
        text[MOST_PHASES - 3 : -3] = [f"{left} more"]
    return ", ".join(text)


def _topics(topics: list[Topic]) -> list[str]:
    width = max([len(row.topic) for row in topics], default=5)
    head = ("messages", "rate", "longest gap", "missing", "lost", "delay", "clock")
    rows = [f"{'topic':<{width}}  {'role':<11}" + "".join(f"{name:>13}" for name in head)]
    for row in topics:
        cells = [str(row.messages)]
        if isinstance(row, Chosen):
            cells += [f"{row.rate:.1f} Hz", f"{1e3 * row.longest_gap:.1f} ms", str(row.missing)]
            cells += [str(row.lost), f"{1e3 * row.delay:+.1f} ms"]
            cells += [f"{1e3 * row.clock_offset:+.1f} ms"]
        line = f"{row.topic:<{width}}  {row.role or '-':<11}"
        rows.append((line + "".join(f"{cell:>13}" for cell in cells)).rstrip())
    chosen = [row for row in topics if isinstance(row, Chosen)]
    if chosen:
        rows += ["", "chosen (to keep it, or another one: in band.yaml)", *_as_yaml(chosen)]
    return rows


def _as_yaml(chosen: list[Chosen]) -> list[str]:
    """The choice of topics as the settings of a band hold it, with the reasons behind it."""
    rows = ["settings:", "  setup:", "    topics:"]
    for row in chosen:
        name = row.topic if re.fullmatch(r"[/\w.-]+", row.topic) else json.dumps(row.topic)
        rows += [f"      {role}: {name}  # {row.type}: {row.why}" for role in row.role.split(", ")]
    return rows


def _phases(phases: list[PhaseLine]) -> list[str]:
    if not phases:
        return []
    rows = [
        "",
        f"mask       {'seconds':>15}{'pictures':>10}{'empty':>7}{'points':>8}{'covered':>9}",
    ]
    for row in phases:
        seconds = f"{row.start:.2f} - {row.end:.2f}"
        rows.append(
            f"  {row.phase:<9}{seconds:>15}{row.pictures:>10}{row.empty:>7}"
            f"{row.points:>8}{100 * row.coverage:>7.0f} %"
        )
    return rows


def _delays(delays: dict[str, DelayFacts]) -> list[str]:
    if not delays:
        return []
    rows = ["", "delays against the force's stamps"]
    for role, delay in delays.items():
        value, error = delay.value_s, delay.error_s
        shown = "-" if value is None else f"{round(1e3 * value, 1) + 0.0:+.1f} ms"
        shown += "" if error is None else f" ± {1e3 * error:.1f} ms"
        done = "taken out" if delay.applied else "left as it is"
        rows.append(f"  {role:<10}{shown}  ({delay.source}, {done})")
    return rows


def _extrinsics(facts: ExtrinsicFacts | None) -> list[str]:
    if not facts:
        return []

    def pair(values: list[float], errors: list[float], unit: float, digits: int = 1) -> str:
        return "  ".join(
            f"{axis} {unit * v:+.{digits}f} ± {unit * e:.{digits}f}"
            for axis, v, e in zip("xyz", values, errors, strict=True)
        )

    rows = [
        "",
        f"extrinsics, by the drawn band in {facts.pictures} pictures (frame O)",
        f"  fork tips off  {pair(facts.tips_m, facts.tips_error_m, 1e3)} mm",
        f"  hand off       {pair(facts.hand_m, facts.hand_error_m, 1e3)} mm",
        f"  what is left   {1e3 * facts.residual_m:.1f} mm",
    ]
    return rows


def _shown(value: object) -> str:
    if isinstance(value, list):
        return " ".join(f"{number:.4f}" for number in value)
    return f"{value:.4f}" if isinstance(value, float) else str(value)
