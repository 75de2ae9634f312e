"""What `sling check` tells of a pull in numbers: each class is an object of its JSON."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.episode.phases import InteractionPhase
from sling2sim2real.recording.calibration import Calibration
from sling2sim2real.recording.checks import camera_to_fork
from sling2sim2real.recording.clouds import Clouds
from sling2sim2real.recording.delays import Delays
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.scene import Scene
from sling2sim2real.recording.signals import Signals
from sling2sim2real.recording.streams import Recording


@dataclass(frozen=True)
class BandFacts:
    """The band that a recording was read with, and where that comes from; no mass: not known."""

    diameter_m: float
    rest_length_m: float
    source: str
    mass_kg: float | None


@dataclass(frozen=True)
class SignalSummary:
    """Events [s since the file's first force], force [N], frame O."""

    window_start_s: float
    grasp_s: float
    grasp_error_s: float
    release_s: float
    release_error_s: float
    release_resolution_s: float
    bias_n: list[float]
    drift_n_s: list[float]
    noise_n: float
    slips_s: list[float]
    peak_force_n: float
    hold_force_n: list[float]
    sign: str
    turn_deg: float
    draw_m: list[float]
    stretch: float

    @classmethod
    def of(cls, recording: Recording, signals: Signals, scene: Scene) -> SignalSummary:
        """Of a pull that is understood."""
        facts = signals.facts
        start = (signals.origin - recording.origin) * 1e-9
        return cls(
            window_start_s=start,
            grasp_s=start + signals.grasp_time,
            grasp_error_s=(recording.gripper or recording.pose).period,
            release_s=start + signals.release_time,
            release_error_s=facts.release_error,
            release_resolution_s=facts.release_resolution,
            bias_n=facts.bias,
            drift_n_s=facts.drift,
            noise_n=facts.noise,
            slips_s=[start + time for time in facts.slips],
            peak_force_n=facts.peak_force,
            hold_force_n=facts.hold_force,
            sign="flipped" if facts.flipped else "as recorded",
            turn_deg=float(np.degrees(facts.turn)),
            draw_m=signals.hand(signals.release_time).tolist(),
            stretch=scene.stretch(signals.release_time - 1e-3),
        )


@dataclass(frozen=True)
class MotionPhase:
    """What the hand does with the drawn band: drawn distance [m], [s since the first force]."""

    kind: str
    begin_s: float
    end_s: float
    from_m: float
    to_m: float
    speed_m_s: float

    @classmethod
    def of(cls, phase: InteractionPhase, start: float) -> MotionPhase:
        """Motion phase from a phase of a window that begins at `start` [s]."""
        times = start + phase.begin, start + phase.end
        return cls(phase.kind, *times, phase.start, phase.stop, phase.speed)

    def __str__(self) -> str:
        if self.kind == "pause":
            return f"pause {self.end_s - self.begin_s:.1f} s"
        way = f"{100 * self.from_m:.0f} to {100 * self.to_m:.0f} cm"
        return f"{self.kind} {way} at {self.speed_m_s:.2f} m/s"


@dataclass(frozen=True)
class DelayFacts:
    """How late a stream's stamps are against the force's, with its standard error."""

    value_s: float | None
    error_s: float | None
    source: str
    applied: bool

    @classmethod
    def of(cls, delays: Delays) -> dict[str, DelayFacts]:
        """Facts by the name of what is late: pose and camera."""
        return {
            role: cls(
                None if delay.error is None else delay.value,
                delay.error,
                delay.source,
                delay.applied,
            )
            for role, delay in (("pose", delays.pose), ("camera", delays.camera))
        }


@dataclass(frozen=True)
class CloudFacts:
    """How well the band is seen, over the whole recording."""

    frames: int
    empty: int
    damaged: int
    unpaired: int
    points_least: int
    points_median: int
    told_by_color: bool
    taut_coverage: float | None
    taut_offset_m: float | None

    @classmethod
    def of(cls, clouds: Clouds, taut: tuple[float | None, float | None]) -> CloudFacts:
        """Of the clouds, and what `clouds.taut_coverage` says of them."""
        sizes = [len(points) for points in clouds.points]
        covered, off = taut
        return cls(
            frames=len(sizes),
            empty=clouds.empty,
            damaged=clouds.damaged,
            unpaired=clouds.unpaired,
            points_least=int(np.min(sizes)),
            points_median=int(np.median(sizes)),
            told_by_color=clouds.color_counts,
            taut_coverage=covered,
            taut_offset_m=off,
        )


@dataclass(frozen=True)
class ExtrinsicFacts:
    """How far fork tips and hand are off in the clouds, frame O, with standard errors.

    `camera_to_fork` is what would put the camera's clouds in their place, as setup has it.
    """

    pictures: int
    off_m: float
    off_error_m: float
    tips_m: list[float]
    tips_error_m: list[float]
    hand_off_m: float
    hand_off_error_m: float
    hand_m: list[float]
    hand_error_m: list[float]
    residual_m: float
    camera_to_fork: list[float]

    @classmethod
    def of(cls, seen: Calibration, geometry: Geometry) -> ExtrinsicFacts:
        return cls(
            seen.frames,
            *seen.camera_off,
            seen.camera.tolist(),
            seen.camera_error.tolist(),
            *seen.hand_off,
            seen.hand.tolist(),
            seen.hand_error.tolist(),
            seen.residual,
            camera_to_fork(seen, geometry),
        )
