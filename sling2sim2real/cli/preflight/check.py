"""What is in a recording, what is missing or wrong, and whether it can be used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sling2sim2real.api.arguments import USUAL
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.preflight import facts
from sling2sim2real.cli.preflight.report import CheckReport, Topic
from sling2sim2real.episode.phases import phases_of_hand, unseen
from sling2sim2real.recording.build import Processed, Whole, process
from sling2sim2real.recording.checks import Finding
from sling2sim2real.recording.clouds import by_phase
from sling2sim2real.recording.events import parts_of
from sling2sim2real.recording.files import Container, read_container, sha256
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.streams import Recording, recording_of
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandParams, SetupParams

MASS = 0.03  # kg: stands for what is not known, and nothing is judged by it


@dataclass(frozen=True)
class Look:
    """The report, and as much of the recording as could be worked out for those who draw it.

    Attributes:
        recording: With its stamps corrected where the pull can be used.
        done: The pull that the report is about, where it was processed to its end.
        pulls: All of the recording, as far as each goes.
    """

    report: CheckReport
    recording: Recording | None = None
    done: Whole | None = None
    pulls: Sequence[Processed] = ()


@dataclass(frozen=True)
class GivenBand:
    """A band as far as whoever checks its recording knows it: where it is from, and its mass."""

    params: BandParams
    source: str = "given"
    weighed: bool = True

    @classmethod
    def of(cls, sizes: Mapping[str, float], setup: SetupParams) -> GivenBand:
        """A band of some sizes, with usual ones for the others.

        Raises UserError where it does not reach across the fork.
        """
        whole = {"mass": MASS, **USUAL, **sizes}
        names = [name for name in USUAL if name not in sizes]
        source = "given"
        if names:
            taken = " and ".join(f"--{n.replace('_', '-')} {USUAL[n]:g}" for n in names)
            source = f"assumed: {taken}; give yours"
        expect_long(whole["rest_length"], setup)
        band = BandParams(source="recording", **whole)
        return cls(band, source, weighed="mass" in sizes)

    @property
    def facts(self) -> facts.Facts:
        band = self.params
        return {
            "diameter_m": float(band.diameter),
            "rest_length_m": float(band.rest_length),
            "source": self.source,
            "mass_kg": float(band.mass) if self.weighed else None,
        }


def expect_long(rest_length: float, setup: SetupParams) -> None:
    """Raises UserError where a band does not reach from tip to tip."""
    if rest_length <= setup.fork_width:
        raise UserError(
            f"--rest-length {rest_length:g}: must be longer than setup.fork_width"
            f" {setup.fork_width:g}"
        )


def look_at(
    path: Path,
    params: Settings,
    band: GivenBand,
    pull: int | None = None,
) -> Look:
    """Look at a recording as far as it can be read: the report, and what it was made from.

    Args:
        path: The MCAP file.
        band: With what is known of it.
        pull: Which of several; None for the first that can be used, if there is one.

    Raises:
        UserError: where there is no MCAP file to look at. Anything else is in the report.
    """
    container = read_container(Path(path))
    report = CheckReport(
        path=str(path),
        sha256=sha256(path),
        problem=None,
        losses=container.losses,
        notes=container.notes,
        topics=_topics(container),
        band=band.facts,
    )
    recording = None
    try:
        recording = recording_of(container, params.setup, params.episode.delays)
        report.losses, report.notes = recording.losses, recording.notes
        _add_roles(report.topics, recording)
        parts = parts_of(recording, geometry_of(recording, params.setup))
    except UserError as error:
        report.problem = _without(path, error)
        report.pulls = [report.row] if recording else []
        return Look(report, recording)
    if pull is not None and pull > len(parts):
        raise UserError(f"--pull {pull}: the last pull in {path} is number {len(parts)}")
    processed = [process(part, band.params, params, band.weighed) for part in parts]
    looks = [_look_at_pull(replace(report), pull_checked) for pull_checked in processed]
    usable = [look for look in looks if look.report.usable]
    chosen = looks[pull - 1] if pull else (usable or looks)[0]
    chosen.report.pulls = [look.report.row for look in looks]
    return replace(chosen, pulls=processed)


def _look_at_pull(report: CheckReport, done: Processed) -> Look:
    """Fills the report of what the file is with what the pull is, as far as it can be used."""
    part, signals, whole, refusal = done.part, done.signals, done.whole, done.refusal
    recording = whole.pull.recording if whole else part.recording
    report.pull, report.frames = part.number, part.geometry.sources
    report.cautions = done.cautions
    report.problem = _without(recording.path, refusal) if refusal else None
    if done.delays:
        report.delays = facts.of_delays(done.delays)
    if signals and done.scene:
        report.signals = facts.of_signals(recording, signals, done.scene)
        phases, start = phases_of_hand(signals), report.signals["window_start_s"]
        report.motion = [facts.of_phase(phase, start) for phase in phases]
        report.keeps_prior = unseen(phases)
    if whole:
        report.cloud, report.extrinsics = facts.of_clouds(whole), facts.of_extrinsics(whole)
        report.coverage = whole.coverage
        report.phases = by_phase(report.coverage)
    return Look(report, recording, whole)


def _without(path: Path, problem: UserError | Finding) -> str:
    return str(problem).removeprefix(f"{path}: ")


def _topics(container: Container) -> list[Topic]:
    rows = [Topic(t.name, t.schema.name, len(t.log_times)) for t in container.topics]
    return sorted(rows, key=lambda row: row.topic)


def _add_roles(topics: list[Topic], recording: Recording) -> None:
    places = {row.topic: place for place, row in enumerate(topics)}
    for role, stream in recording.streams.items():
        place = places[stream.topic]
        row = topics[place]
        topics[place] = Topic(
            row.topic,
            row.type,
            row.messages,
            role=f"{row.role}, {role}" if row.role else role,
            why=recording.choices[role],
            rate=1 / stream.period,
            longest_gap=stream.longest_gap,
            missing=stream.missing,
            lost=stream.lost,
            delay=stream.receipt_delay,
            clock_offset=recording.wrench.receipt_delay - stream.receipt_delay,
            notes=list(stream.notes),
        )
