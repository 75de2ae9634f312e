"""A recording to its `Episode`s: the whole way from messages to signals and clouds in frame O."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording import checks
from sling2sim2real.recording.calibration import Calibration, calibration_of
from sling2sim2real.recording.checks import Finding
from sling2sim2real.recording.clouds import (
    Clouds,
    PictureLine,
    clouds_of,
    over_time,
    taut_coverage,
)
from sling2sim2real.recording.delays import Delays, correct_delays
from sling2sim2real.recording.events import Part, Pull, parts_of
from sling2sim2real.recording.frames import EpisodeGeometry, geometry_of
from sling2sim2real.recording.scene import Scene, View
from sling2sim2real.recording.signals import Signals, signals_of
from sling2sim2real.recording.streams import explained, read_recording
from sling2sim2real.settings import Settings, expect_known
from sling2sim2real.settings.lab import BandParams


@dataclass(frozen=True)
class Whole:
    """A pull that was processed to its end.

    Attributes:
        pull: With its events, its stamps corrected by `delays`.
        coverage: A row a picture.
        taut_coverage: As `clouds.taut_coverage` has it.
        calibration: None where too little of the drawn band is seen.
        start: Of the window, since the file's first force [s].
    """

    pull: Pull
    delays: Delays
    signals: Signals
    scene: Scene
    view: View
    clouds: Clouds
    coverage: list[PictureLine]
    taut_coverage: tuple[float | None, float | None]
    calibration: Calibration | None
    start: float


@dataclass
class Processed:
    """A pull as far as it can be used: what comes after a refusal is None.

    Attributes:
        part: What was recorded of it.
        delays, signals, scene, view: Of its way.
        whole: All of it.
        findings: Of all checks, in the order of the way.
    """

    part: Part
    delays: Delays | None = None
    signals: Signals | None = None
    scene: Scene | None = None
    view: View | None = None
    whole: Whole | None = None
    findings: list[Finding] = field(default_factory=list)

    @property
    def cautions(self) -> list[Finding]:
        """What costs accuracy, and not the recording."""
        return [finding for finding in self.findings if not finding.refused]

    @property
    def refusal(self) -> Finding | None:
        """Why the pull cannot be used."""
        return next((finding for finding in self.findings if finding.refused), None)

    def check(self, findings: Iterable[Finding]) -> None:
        """Keep what a check point finds. Raises UserError where it refuses the pull."""
        self.findings += findings
        if self.refusal:
            raise UserError(str(self.refusal))


def build_episodes(
    path: Path, band_name: str, params: Settings
) -> tuple[list[Episode], list[UserError]]:
    """The episodes of a recording's pulls, in time order, and why others have none, a line each.

    Raises:
        UserError: None can be used: about the first.
    """
    expect_known(params, "band", band_name)
    usable, refused = process_recording(path, params.bands[band_name], params)
    return [episode_of(done, band_name) for done in usable], refused


def process_recording(
    path: Path, band: BandParams, params: Settings
) -> tuple[list[Processed], list[UserError]]:
    """As `build_episodes`, with every step's result."""
    recording = read_recording(path, params.setup, params.episode.delays)
    try:
        parts = parts_of(recording, geometry_of(recording, params.setup))
    except UserError as error:
        raise explained(error, recording.path, recording.losses) from None
    usable: list[Processed] = []
    refused: list[UserError] = []
    for part in parts:
        done = process(part, band, params)
        if done.refusal:
            name = f"pull {part.number} of {part.count}" if part.count > 1 else ""
            error = UserError(str(done.refusal))
            refused.append(explained(error, recording.path, recording.losses, name))
        else:
            usable.append(done)
    if not usable:
        raise refused[0]
    return usable, refused


def process(part: Part, band: BandParams, params: Settings, weighed: bool = True) -> Processed:
    """One pull, step by step, up to the end or to what refuses it.

    Args:
        weighed: Whether the band's mass is known: without it nothing is judged by the weight.
    """
    done, setup = Processed(part), params.setup
    try:
        done.check(checks.of_topics(part))
        pull, delays = correct_delays(Pull.of(part), params)
        signals = signals_of(pull, params, delays.tool_inertia)
        scene = Scene.of(band, setup, signals)
        done.delays, done.signals, done.scene = delays, signals, scene
        done.check(checks.of_signals(pull, delays, signals, scene, band, params, weighed))
        view = done.view = View(pull.recording, part.geometry, scene, signals.duration)
        clouds = clouds_of(view, params.cloud)
        start = (signals.origin - part.recording.origin) * 1e-9
        seen = over_time(scene, clouds, start), taut_coverage(scene, clouds)
        eye, clamp = part.geometry.camera.translation, np.array(setup.clamp_direction)
        calibration = calibration_of(
            scene, clouds.time, clouds.points, eye, float(band.mass), clamp
        )
        done.whole = Whole(pull, delays, signals, scene, view, clouds, *seen, calibration, start)
        done.check(checks.of_pictures(scene, clouds, *seen))
        done.check(checks.of_calibration(calibration, part.geometry))
    except UserError as error:
        if not done.refusal:
            done.findings.append(Finding("pull", str(error), "", refused=True))
    return done


def episode_of(done: Processed, band_name: str) -> Episode:
    """The episode of a pull that can be used, with all that was chosen in its metadata."""
    whole = done.whole
    if whole is None or done.refusal:
        raise UserError(str(done.refusal))
    pull, signals, clouds = whole.pull, whole.signals, whole.clouds
    recording, geometry = pull.recording, pull.geometry

    metadata = {
        "input": {
            "file": recording.path.name,
            "pull": pull.number,
            "sha256": recording.sha256,
            "start_ns": signals.origin,
            "topics": {role: stream.topic for role, stream in recording.streams.items()},
            "choices": recording.choices,
            "frames": geometry.sources,
            "losses": recording.losses,
        },
        "cautions": [caution.content() for caution in done.cautions],
        "geometry": EpisodeGeometry.of(recording, geometry).content(),
        "preprocessing": {**asdict(signals.facts), "delays": asdict(whole.delays)},
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
