"""A recording to its `Episode`s: the whole way from MCAP to signals and clouds in frame O."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pipeline.base.errors import UserError
from pipeline.base.schema import Section
from pipeline.episode.episode import Episode
from pipeline.params import Params, expect_known
from pipeline.params.lab import BandParams
from pipeline.recording.cloud import Clouds, clouds_of
from pipeline.recording.delays import Delays, correct_delays
from pipeline.recording.geometry import EpisodeGeometry
from pipeline.recording.input.reader import explained, read_recording
from pipeline.recording.pulls import Pull, pulls_of
from pipeline.recording.signals import Signals, signals_of
from pipeline.recording.view import Scene, View


@dataclass(frozen=True)
class Processed:
    """Every step's result for one pull. What is below `delays` is computed when first asked for.

    Attributes:
        pull: With the stamps corrected by `delays`.
    """

    pull: Pull
    delays: Delays
    band: BandParams
    params: Params

    @classmethod
    def of(cls, pull: Pull, band: BandParams, params: Params) -> Processed:
        return cls(*correct_delays(pull, params), band, params)

    @cached_property
    def signals(self) -> Signals:
        """Raises UserError."""
        return signals_of(self.pull, self.params, self.delays.tool_inertia)

    @cached_property
    def scene(self) -> Scene:
        """Raises UserError."""
        return Scene.of(self.band, self.params.setup, self.signals)

    @cached_property
    def view(self) -> View:
        """Raises UserError."""
        duration = self.params.episode.duration
        return View(self.pull.recording, self.pull.geometry, self.scene, duration)

    @cached_property
    def clouds(self) -> Clouds:
        """Raises UserError."""
        return clouds_of(self.view, self.params.cloud)


def process(path: Path, band: BandParams, params: Params) -> Processed:
    """Of a recording's pulls the first that can be used. Raises UserError."""
    return process_pulls(path, band, params)[0][0]


def process_pulls(
    path: Path, band: BandParams, params: Params
) -> tuple[list[Processed], list[UserError]]:
    """Read, then for each pull resolve frames, set stamps right, find events, mask.

    Returns:
        The pulls that can be used, in time order, and why others cannot, in a line each.

    Raises:
        UserError: None can be used: about the first.
    """
    recording = read_recording(path, params.setup)
    usable: list[Processed] = []
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


def process_pull(pull: Pull, band: BandParams, params: Params) -> Processed:
    """All of one pull. Raises UserError where it cannot be used."""
    done = Processed.of(pull, band, params)
    _ = done.clouds
    return done


def build_episodes(
    path: Path, band_name: str, params: Params
) -> tuple[list[Episode], list[UserError]]:
    """The episodes of a recording's pulls, and why others have none; see `process_pulls`."""
    expect_known(params, "band", band_name)
    usable, refused = process_pulls(path, params.bands[band_name], params)
    return [episode_of(done, band_name, params) for done in usable], refused


def episode_of(done: Processed, band_name: str, params: Params) -> Episode:
    """The episode, with everything in its metadata that was chosen on the way."""
    signals, clouds = done.signals, done.clouds
    recording, geometry = done.pull.recording, done.pull.geometry

    def of_streams(name: str) -> dict[str, Any]:
        return {role: getattr(stream, name) for role, stream in recording.streams.items()}

    removal = "statistical_neighbors", "statistical_ratio", "radius", "radius_neighbors", "sampling"
    metadata = {
        "setup": {
            **_named(params.setup, "fork_width", "fork_height"),
            "band": _named(params.bands[band_name], "mass", "diameter", "rest_length"),
        },
        "input": {
            "file": recording.path.name,
            "pull": done.pull.number,
            "sha256": recording.sha256,
            "start_ns": signals.origin,
            "topics": of_streams("topic"),
            "choices": recording.choices,
            "frames": geometry.sources,
            "delays": of_streams("delay"),
            "lost": of_streams("lost"),
            "missing": of_streams("missing"),
            "losses": recording.losses,
            "notes": recording.notes,
        },
        "geometry": EpisodeGeometry.of(recording, geometry).content(),
        "preprocessing": {
            **asdict(signals.facts),
            "delays": asdict(done.delays),
            **_named(params.force, "cutoff", "cutoff_unit"),
            **_named(params.cloud, "mask", "points", *removal),
            "mask_colors": clouds.color_counts,
            "empty_clouds": clouds.empty,
            "damaged_frames": clouds.damaged,
            "unpaired_frames": clouds.unpaired,
        },
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


def _named(section: Section, *names: str) -> dict[str, Any]:
    return {name: getattr(section, name) for name in names}
