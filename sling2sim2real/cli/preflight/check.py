"""What is in a recording, what is missing or wrong, and whether it can be used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sling2sim2real.api.arguments import USUAL
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.preflight import facts
from sling2sim2real.cli.preflight.report import Report, new_report, pull_line
from sling2sim2real.recording.build import Processed, Whole, process
from sling2sim2real.recording.events import parts_of
from sling2sim2real.recording.files import read_container, sha256
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.streams import Recording, recording_of
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandParams, SetupParams

MASS = 0.03  # kg: stands for what is not known, and nothing is judged by it


@dataclass(frozen=True)
class Look:
    """A recording's report, and as much of it as could be worked out for those who draw it.

    Attributes:
        report: As of `report`; `problem` is None where the pull can be used.
        recording: With its stamps corrected where the pull can be used.
        done: The pull that the report is about, where it was processed to its end.
        pulls: All of the recording, as far as each goes.
    """

    report: Report
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
    report = new_report(path, band.facts) | {
        "sha256": sha256(path),
        "losses": container.losses,
        "notes": container.notes,
        "topics": facts.of_topics(container),
    }
    recording = None
    try:
        recording = recording_of(container, params.setup, params.episode.delays)
        report |= {"losses": recording.losses, "notes": recording.notes}
        report["topics"] = facts.of_topics(container, recording)
        parts = parts_of(recording, geometry_of(recording, params.setup))
    except UserError as error:
        report["problem"] = str(error).removeprefix(f"{path}: ")
        report["pulls"] = [pull_line(report)] if recording else []
        return Look(report, recording)
    if pull is not None and pull > len(parts):
        raise UserError(f"--pull {pull}: the last pull in {path} is number {len(parts)}")
    processed = [process(part, band.params, params, band.weighed) for part in parts]
    reports = [report | facts.of_pull(done) for done in processed]
    usable = [number for number, one in enumerate(reports) if one["problem"] is None]
    number = pull - 1 if pull else (usable or [0])[0]
    report, done = reports[number], processed[number].whole
    report["pulls"] = [pull_line(one) for one in reports]
    shown = done.pull.recording if done else parts[number].recording
    return Look(report, shown, done, processed)
