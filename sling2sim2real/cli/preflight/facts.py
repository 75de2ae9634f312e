"""What `sling check` tells of a recording in numbers: each function makes a part of its JSON.

Names end with their unit; times are seconds since the file's first force, vectors are of frame O.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sling2sim2real.episode.phases import InteractionPhase, phases_of_hand, unseen
from sling2sim2real.recording.build import Processed, Whole
from sling2sim2real.recording.calibration import Calibration
from sling2sim2real.recording.checks import camera_to_fork
from sling2sim2real.recording.clouds import by_phase
from sling2sim2real.recording.delays import Delays
from sling2sim2real.recording.files import Container
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.scene import Scene
from sling2sim2real.recording.signals import Signals
from sling2sim2real.recording.streams import Recording

Facts = dict[str, Any]


def of_topics(container: Container, recording: Recording | None = None) -> list[Facts]:
    """A row a topic, with what is known of those that play a role.

    Of these: `role` (several with commas between them), `why` it was chosen, `rate` [Hz],
    `longest_gap` [s], `missing` messages by that rate, `lost` ones, `delay` of receipt [s],
    `clock_offset` by which the stamps are ahead of the force's [s], and `notes` of what was mended.
    """
    rows: dict[str, Facts] = {
        topic.name: {
            "topic": topic.name,
            "type": topic.schema.name,
            "messages": len(topic.log_times),
            "role": None,
        }
        for topic in container.topics
    }
    for role, stream in recording.streams.items() if recording else ():
        assert recording
        row = rows[stream.topic]
        row |= {
            "role": f"{row['role']}, {role}" if row["role"] else role,
            "why": recording.choices[role],
            "rate": 1 / stream.period,
            "longest_gap": stream.longest_gap,
            "missing": stream.missing,
            "lost": stream.lost,
            "delay": stream.receipt_delay,
            "clock_offset": recording.wrench.receipt_delay - stream.receipt_delay,
            "notes": list(stream.notes),
        }
    return [rows[name] for name in sorted(rows)]


def of_pull(done: Processed) -> Facts:
    """What a report says of one pull, as far as it can be used."""
    part, signals, whole, refusal = done.part, done.signals, done.whole, done.refusal
    problem = str(refusal).removeprefix(f"{part.recording.path}: ") if refusal else None
    told: Facts = {
        "pull": part.number,
        "frames": part.geometry.sources,
        "cautions": [caution.content() for caution in done.cautions],
        "problem": problem,
    }
    if done.delays:
        told["delays"] = of_delays(done.delays)
    if signals and done.scene:
        told["signals"] = of_signals(part.recording, signals, done.scene)
        phases, start = phases_of_hand(signals), told["signals"]["window_start_s"]
        told["motion"] = [of_phase(phase, start) for phase in phases]
        told["keeps_prior"] = unseen(phases)
    if whole:
        told["cloud"] = of_clouds(whole)
        told["phases"] = by_phase(whole.coverage)
        if whole.calibration:
            told["extrinsics"] = of_extrinsics(whole.calibration, part.geometry)
    return told


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


def of_extrinsics(seen: Calibration, geometry: Geometry) -> Facts:
    """How far fork tips and hand are off in the clouds, with standard errors.

    `camera_to_fork` is what would put the camera's clouds in their place, as setup has it.
    """
    facts: Facts = {"pictures": seen.frames, "residual_m": seen.residual}
    for name, off, distance in (
        ("tips", (seen.camera, seen.camera_error), seen.camera_off),
        ("hand", (seen.hand, seen.hand_error), seen.hand_off),
    ):
        facts |= {f"{name}_m": off[0].tolist(), f"{name}_error_m": off[1].tolist()}
        facts |= {f"{name}_off_m": distance[0], f"{name}_off_error_m": distance[1]}
    return facts | {"camera_to_fork": camera_to_fork(seen, geometry)}
