"""A recording to its `Episode`s: the whole way from MCAP to signals and clouds in frame O."""

from __future__ import annotations

from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording.checks.finding import Finding
from sling2sim2real.recording.checks.table import findings_of
from sling2sim2real.recording.geometry import EpisodeGeometry
from sling2sim2real.recording.input.reader import explained, read_recording
from sling2sim2real.recording.processed import Processed
from sling2sim2real.recording.pulls import Pull, pulls_of
from sling2sim2real.settings import Settings, expect_known
from sling2sim2real.settings.lab import BandParams


class Checked(Processed):
    """A pull, and what its checks find."""

    @cached_property
    def findings(self) -> list[Finding]:
        """Findings of all checks, in the order in which a recording is processed."""
        return findings_of(self)

    @property
    def cautions(self) -> list[Finding]:
        """What costs accuracy, and not the recording."""
        return [finding for finding in self.findings if not finding.refused]

    @property
    def refusal(self) -> Finding | None:
        """Why the pull cannot be used."""
        return next((finding for finding in self.findings if finding.refused), None)


def process(path: Path, band: BandParams, params: Settings) -> Checked:
    """Return the first of a recording's pulls that can be used. Raises UserError."""
    return process_pulls(path, band, params)[0][0]


def process_pulls(
    path: Path, band: BandParams, params: Settings
) -> tuple[list[Checked], list[UserError]]:
    """Read, then for each pull resolve frames, set stamps right, find events, mask.

    Returns:
        The pulls that can be used, in time order, and why others cannot, in a line each.

    Raises:
        UserError: None can be used: about the first.
    """
    recording = read_recording(path, params.setup, params.episode.delays)
    usable: list[Checked] = []
    refused: list[UserError] = []
    try:
        pulls = pulls_of(Pull.of(recording, params.setup))
    except UserError as error:
        raise explained(error, recording.path, recording.losses) from None
    for pull in pulls:
        try:
            usable.append(process_pull(pull, band, params))
        except UserError as error:
            name = f"pull {pull.number} of {pull.count}" if pull.count > 1 else ""
            refused.append(explained(error, recording.path, recording.losses, name))
    if not usable:
        raise refused[0]
    return usable, refused


def process_pull(pull: Pull, band: BandParams, params: Settings) -> Checked:
    """Process one pull: correct its delays, then run all checks, which ask for signals and clouds.

    Raises UserError where it cannot be used.
    """
    done = Checked.of(pull, band, params)
    if done.refusal:
        raise UserError(str(done.refusal))
    return done


def build_episodes(
    path: Path, band_name: str, params: Settings
) -> tuple[list[Episode], list[UserError]]:
    """The episodes of a recording's pulls, and why others have none; see `process_pulls`."""
    expect_known(params, "band", band_name)
    usable, refused = process_pulls(path, params.bands[band_name], params)
    return [episode_of(done, band_name, params) for done in usable], refused


def episode_of(done: Checked, band_name: str, params: Settings) -> Episode:
    """The episode, with everything in its metadata that was chosen on the way."""
    signals, clouds = done.signals, done.clouds
    recording, geometry = done.pull.recording, done.pull.geometry

    def of_streams(name: str) -> dict[str, Any]:
        return {role: getattr(stream, name) for role, stream in recording.streams.items()}

    metadata = {
        "input": {
            "file": recording.path.name,
            "pull": done.pull.number,
            "sha256": recording.sha256,
            "start_ns": signals.origin,
            "topics": of_streams("topic"),
            "choices": recording.choices,
            "frames": geometry.sources,
            "delays": of_streams("receipt_delay"),
            "lost": of_streams("lost"),
            "missing": of_streams("missing"),
            "losses": recording.losses,
            "notes": recording.notes,
        },
        "cautions": [caution.content() for caution in done.cautions],
        "geometry": EpisodeGeometry.of(recording, geometry).content(),
        "preprocessing": {**asdict(signals.facts), "delays": asdict(done.delays)},
    }
    return Episode(
        band=band_name,
        time=signals.time,
        position=signals.position,
        velocity=signals.velocity,
        force=signals.force,
        opening=signals.opening,
        cloud_time=clouds.time,
        clouds=clouds.points,
        grasp_time=signals.grasp_time,
        release_time=signals.release_time,
        camera=geometry.camera.translation,
        metadata=metadata,
    )
