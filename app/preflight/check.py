"""What is in a recording, what is missing or wrong, and whether it can be used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.preflight.coverage import by_phase, coverage, over_time
from app.preflight.report import CheckReport, Topic
from app.preflight.tips import Tips, along, measure_tips
from app.preflight.verdict import cautions_of
from app.sizes import DIAMETER, MASS, REST_LENGTH, band_to_come
from pipeline.base.errors import UserError
from pipeline.params import Params, expect_known
from pipeline.params.lab import BandParams
from pipeline.recording.build import Processed
from pipeline.recording.delays import Delays
from pipeline.recording.input.bag import sha256
from pipeline.recording.input.container import Container, read_container
from pipeline.recording.input.frames import Transform
from pipeline.recording.input.reader import Recording, recording_of
from pipeline.recording.pulls import Pull, pulls_of

__all__ = ["Look", "check_recording", "coverage", "look_at"]

COMMON = BandParams(source="recording", mass=MASS, diameter=DIAMETER, rest_length=REST_LENGTH)
ASSUMED = "assumed: give --band, or --diameter and --rest-length"


@dataclass(frozen=True)
class Look:
    """The report, and as much of the recording as could be worked out for those who draw it.

    Attributes:
        recording: With its stamps corrected where the pull can be used.
        done: The pull that the report is about, where it can be used.
        pulls: All of the recording, as far as each goes.
    """

    report: CheckReport
    recording: Recording | None = None
    done: Processed | None = None
    tips: Tips | None = None
    pulls: Sequence[Processed] = ()


def check_recording(path: Path, params: Params, band: BandParams | None = None) -> CheckReport:
    """Look at a recording as far as it can be read.

    Args:
        path: The MCAP file.
        band: Of which diameter and rest_length count; a common one if None.

    Raises:
        UserError: where there is no MCAP file to look at. Anything else is in the report.
    """
    return look_at(path, params, band).report


def look_at(
    path: Path,
    params: Params,
    band: BandParams | None = None,
    source: str = "given",
    pull: int | None = None,
) -> Look:
    """As `check_recording`, with what it was told from.

    Args:
        source: Where `band` is from.
        pull: Which of several; None for the first that can be used, if there is one.
    """
    container = read_container(Path(path))
    about = band or COMMON
    report = CheckReport(
        path=str(path),
        sha256=sha256(path),
        problem=None,
        losses=container.losses,
        notes=container.notes,
        topics=_topics(container),
        band={
            "diameter_m": float(about.diameter),
            "rest_length_m": float(about.rest_length),
            "source": source if band else ASSUMED,
        },
    )
    recording = None
    try:
        recording = recording_of(container, params.setup)
        report.losses, report.notes = recording.losses, recording.notes
        _add_roles(report.topics, recording)
        pulls = pulls_of(Pull.of(recording, params.setup))
    except UserError as error:
        report.problem = _without(path, error)
        report.pulls = [report.row] if recording else []
        return Look(report, recording)
    if pull is not None and pull > len(pulls):
        raise UserError(f"--pull {pull}: the last pull in {path} is number {len(pulls)}")
    processed = [Processed.of(one, about, params) for one in pulls]
    looks = [_look_at_pull(replace(report), one) for one in processed]
    usable = [look for look in looks if look.report.usable]
    chosen = looks[pull - 1] if pull else (usable or looks)[0]
    chosen.report.pulls = [look.report.row for look in looks]
    return replace(chosen, pulls=processed)


def band_of(
    params: Params, name: str | None, diameter: float | None, rest_length: float | None
) -> tuple[BandParams | None, str]:
    """The band that a command line names, None where it names none, and where it is from.

    Raises:
        UserError: about a name that is not known, or a band that does not reach across the fork.
    """
    if name is not None and (diameter or rest_length):
        raise UserError("--band brings its diameter and rest length: leave the other two out")
    if name is not None:
        expect_known(params, "band", name, called="--band")
        return params.bands[name], f"bands.{name} of params.yaml"
    if diameter is None and rest_length is None:
        return None, ASSUMED
    band = band_to_come(params, None, diameter, rest_length)
    left = [n for n, v in (("--diameter", diameter), ("--rest-length", rest_length)) if v is None]
    return band, f"given, but assumed: {left[0]}" if left else "given"


def _look_at_pull(report: CheckReport, done: Processed) -> Look:
    """Fills the report of what the file is with what the pull is."""
    recording = done.pull.recording
    report.pull, report.frames = done.pull.number, done.pull.geometry.sources
    report.delays = _delays(done.delays)
    try:
        report.signals = _signal_facts(done)
        report.cloud = _cloud_facts(done)
    except UserError as error:
        report.problem = _without(recording.path, error)
        return Look(report, recording)
    report.coverage = over_time(done, report.signals["window_start_s"])
    report.phases = by_phase(report.coverage)
    tips = measure_tips(
        done.scene,
        done.clouds.time,
        done.clouds.points,
        done.pull.geometry.camera.translation,
        np.array(done.params.setup.clamp_direction),
    )
    if tips:
        report.extrinsics = _extrinsics(tips, done)
    if report.cloud["taut_coverage"] is None:
        assumed = report.band["source"] == ASSUMED
        cure = "which is assumed: give --rest-length" if assumed else "check it"
        report.problem = (
            "no picture shows the band drawn taut at a rest length of"
            f" {report.band['rest_length_m']:g} m, {cure}, or record a longer pull"
        )
    report.cautions = cautions_of(report, done)
    return Look(report, recording, done, tips)


def _without(path: Path, error: UserError) -> str:
    return str(error).removeprefix(f"{path}: ")


def _topics(container: Container) -> list[Topic]:
    rows = [Topic(c.topic, c.schema.name, len(c.payloads)) for c in container.channels]
    return sorted(rows, key=lambda row: row.topic)


def _add_roles(topics: list[Topic], recording: Recording) -> None:
    by_name = {row.topic: row for row in topics}
    for role, stream in recording.streams.items():
        row = by_name[stream.topic]
        row.role = f"{row.role}, {role}" if row.role else role
        row.why = recording.choices[role]
        row.rate, row.longest_gap = 1 / stream.period, stream.longest_gap
        row.missing, row.lost = stream.missing, stream.lost
        row.delay, row.clock_offset = stream.delay, recording.wrench.delay - stream.delay
        row.notes = list(stream.notes)


def _signal_facts(done: Processed) -> dict[str, Any]:
    recording, signals, scene = done.pull.recording, done.signals, done.scene
    facts = signals.facts
    start = (signals.origin - recording.origin) * 1e-9
    by = recording.gripper or recording.pose
    return {
        "window_start_s": start,
        "grasp_s": start + signals.grasp_time,
        "grasp_error_s": by.period,
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


def _delays(delays: Delays) -> dict[str, dict]:
    return {
        role: {
            "value_s": None if one.error is None else one.value,
            "error_s": one.error,
            "source": one.source,
            "applied": bool(one.applied),
        }
        for role, one in (("pose", delays.pose), ("camera", delays.camera))
    }


def _cloud_facts(done: Processed) -> dict[str, object]:
    clouds = done.clouds
    sizes = [len(points) for points in clouds.points]
    covered, off = coverage(done)
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


def _extrinsics(tips: Tips, done: Processed) -> dict[str, object]:
    geometry, turn = done.pull.geometry, tips.correction.rotation.as_rotvec()
    believed = geometry.camera @ geometry.color.inverse()
    return {
        "pictures": tips.frames,
        "off_m": tips.off,
        "off_error_m": tips.off_error,
        "left_tip_m": tips.offsets[0].tolist(),
        "left_tip_error_m": tips.errors[0].tolist(),
        "right_tip_m": tips.offsets[1].tolist(),
        "right_tip_error_m": tips.errors[1].tolist(),
        "turn_deg": np.degrees(-turn).tolist(),
        "turn_error_deg": np.degrees(tips.rotation_error).tolist(),
        "hand_off_m": float(np.linalg.norm(tips.hand)),
        "hand_off_error_m": along(tips.hand, tips.hand_error),
        "hand_m": tips.hand.tolist(),
        "hand_error_m": tips.hand_error.tolist(),
        "residual_m": tips.residual,
        "camera_to_fork": _pose((tips.correction @ believed).inverse()),
    }


def _pose(transform: Transform) -> list[float]:
    """As setup.camera_to_fork has it."""
    parts = [*transform.translation, *transform.rotation.as_quat(canonical=True)]
    return [round(float(number), 6) for number in parts]
