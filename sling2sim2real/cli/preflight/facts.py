"""What `sling check` tells of a pull in numbers: each function makes an object of its JSON.

Names end with their unit; times are seconds since the file's first force, vectors are of frame O.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sling2sim2real.episode.phases import InteractionPhase
from sling2sim2real.recording.build import Whole
from sling2sim2real.recording.checks import camera_to_fork
from sling2sim2real.recording.delays import Delays
from sling2sim2real.recording.scene import Scene
from sling2sim2real.recording.signals import Signals
from sling2sim2real.recording.streams import Recording

Facts = dict[str, Any]


def of_signals(recording: Recording, signals: Signals, scene: Scene) -> Facts:
    """Events and force of a pull that is understood."""
    facts = signals.facts
    start = (signals.origin - recording.origin) * 1e-9
    return {
        "window_start_s": start,
        "grasp_s": start + signals.grasp_time,
        "grasp_error_s": (recording.gripper or recording.pose).period,
        "release_s": start + signals.release_time,
        "release_error_s": facts.release_error,
        "release_resolution_s": facts.release_resolution,
        "bias_n": facts.bias,
        "drift_n_s": facts.drift,
        "noise_n": facts.noise,
        "slips_s": [start + time for time in facts.slips],
        "peak_force_n": facts.peak_force,
        "hold_force_n": facts.hold_force,
        "sign": "flipped" if facts.flipped else "as recorded",
        "turn_deg": float(np.degrees(facts.turn)),
        "draw_m": signals.hand(signals.release_time).tolist(),
        "stretch": scene.stretch(signals.release_time - 1e-3),
    }


def of_phase(phase: InteractionPhase, start: float) -> Facts:
    """What the hand does with the drawn band, in a window that begins at `start` [s]."""
    return {
        "kind": phase.kind,
        "begin_s": start + phase.begin,
        "end_s": start + phase.end,
        "from_m": phase.start,
        "to_m": phase.stop,
        "speed_m_s": phase.speed,
    }


def of_delays(delays: Delays) -> dict[str, Facts]:
    """How late the stamps of pose and camera are against the force's, with standard errors."""
    return {
        role: {
            "value_s": None if delay.error is None else delay.value,
            "error_s": delay.error,
            "source": delay.source,
            "applied": delay.applied,
        }
        for role, delay in (("pose", delays.pose), ("camera", delays.camera))
    }


def of_clouds(whole: Whole) -> Facts:
    """How well the band is seen, over the whole recording."""
    clouds, sizes = whole.clouds, [len(points) for points in whole.clouds.points]
    covered, off = whole.taut_coverage
    return {
        "frames": len(sizes),
        "empty": clouds.empty,
        "damaged": clouds.damaged,
        "unpaired": clouds.unpaired,
        "points_least": int(np.min(sizes)),
        "points_median": int(np.median(sizes)),
        "told_by_color": clouds.color_counts,
        "taut_coverage": covered,
        "taut_offset_m": off,
    }


def of_extrinsics(whole: Whole) -> Facts:
    """How far fork tips and hand are off in the clouds, with standard errors; {} if not known.

    `camera_to_fork` is what would put the camera's clouds in their place, as setup has it.
    """
    seen = whole.calibration
    if not seen:
        return {}
    (off, error), (hand_off, hand_error) = seen.camera_off, seen.hand_off
    return {
        "pictures": seen.frames,
        "off_m": off,
        "off_error_m": error,
        "tips_m": seen.camera.tolist(),
        "tips_error_m": seen.camera_error.tolist(),
        "hand_off_m": hand_off,
        "hand_off_error_m": hand_error,
        "hand_m": seen.hand.tolist(),
        "hand_error_m": seen.hand_error.tolist(),
        "residual_m": seen.residual,
        "camera_to_fork": camera_to_fork(seen, whole.pull.geometry),
    }
