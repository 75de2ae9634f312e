"""A recording to its `Episode`s: the whole way from MCAP to signals and clouds in frame O."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.params import expect_known
from pipeline.recording.cloud import Clouds, clouds_of
from pipeline.recording.delays import Delays, delays_of
from pipeline.recording.geometry import Geometry, geometry_of
from pipeline.recording.input.reader import Recording, explained, read_recording
from pipeline.recording.pulls import pulls_of
from pipeline.recording.signals import Signals, signals_of
from pipeline.recording.view import Scene, View


@dataclass(frozen=True)
class Processed:
    """Every step's result, for those who report on a recording.

    Attributes:
        recording: With the stamps corrected by `delays`.
    """

    recording: Recording
    geometry: Geometry
    signals: Signals
    scene: Scene
    clouds: Clouds
    delays: Delays
    view: View


def process(path: Path, band: object, params: object) -> Processed:
    """Of a recording's pulls the first that can be used. Raises UserError."""
    return process_pulls(path, band, params)[0][0]


def process_pulls(
    path: Path, band: object, params: object
) -> tuple[list[Processed], list[UserError]]:
    """Read, then for each pull resolve frames, set stamps right, find events, mask.

    Args:
        band: One of params.bands.

    Returns:
        The pulls that can be used, in time order, and why others cannot, in a line each.

    Raises:
        UserError: None can be used: about the first.
    """
    recording = read_recording(path, params.setup)
    found, refused = [], []
    try:
        pulls = pulls_of(recording, params.setup)
    except UserError as error:
        raise explained(error, recording.path, recording.losses) from None
    for pull in pulls:
        try:
            found.append(process_recording(pull, band, params))
        except UserError as error:
            name = f"pull {pull.pull} of {pull.pulls}" if pull.pulls > 1 else ""
            refused.append(explained(error, pull.path, pull.losses, name))
    if not found:
        raise refused[0]
    return found, refused


def process_recording(recording: Recording, band: object, params: object) -> Processed:
    """From a recording of one pull that was read already. Raises UserError."""
    view, delays = view_of(recording, band, params)
    clouds, scene = clouds_of(view, params.cloud), view.scene
    return Processed(view.recording, view.geometry, scene.signals, scene, clouds, delays, view)


def view_of(recording: Recording, band: object, params: object) -> tuple[View, Delays]:
    """What the camera sees, with everything known that the mask needs. Raises UserError."""
    geometry = geometry_of(recording, params.setup)
    delays = delays_of(recording, geometry, params)
    recording = delays.corrected(recording)
    signals = signals_of(recording, geometry, params, delays.tool_inertia)
    scene = Scene.of(band, params.setup, signals)
    return View(recording, geometry, scene, params.episode.duration), delays


def build_episodes(
    path: Path, band_name: str, params: object
) -> tuple[list[Episode], list[UserError]]:
    """The episodes of a recording's pulls, and why others have none; see `process_pulls`."""
    expect_known(params, "band", band_name)
    found, refused = process_pulls(path, params.bands[band_name], params)
    return [episode_of(done, band_name, params) for done in found], refused


def episode_of(done: Processed, band_name: str, params: object) -> Episode:
    """The episode, with everything in its metadata that was chosen on the way."""
    signals, clouds, recording = done.signals, done.clouds, done.recording

    def of_streams(name: str) -> dict:
        return {role: getattr(stream, name) for role, stream in recording.streams.items()}

    removal = "statistical_neighbors", "statistical_ratio", "radius", "radius_neighbors", "sampling"
    metadata = {
        "setup": {
            **_named(params.setup, "fork_width", "fork_height"),
            "band": _named(params.bands[band_name], "mass", "diameter", "rest_length"),
        },
        "input": {
            "file": recording.path.name,
            "pull": recording.pull,
            "sha256": recording.sha256,
            "start_ns": signals.origin,
            "topics": of_streams("topic"),
            "choices": recording.choices,
            "frames": done.geometry.sources,
            "delays": of_streams("delay"),
            "lost": of_streams("lost"),
            "missing": of_streams("missing"),
            "losses": recording.losses,
            "notes": recording.notes,
        },
        "preprocessing": {
            **signals.facts,
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
        camera=done.geometry.camera.translation,
        metadata=metadata,
    )


def _named(section: object, *names: str) -> dict:
    return {name: getattr(section, name) for name in names}
