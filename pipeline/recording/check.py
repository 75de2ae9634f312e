"""What is in a recording, what is missing or wrong, and whether it can be used."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from pipeline.errors import UserError
from pipeline.recording.build import Processed, process_recording
from pipeline.recording.container import Container, read_container, sha256
from pipeline.recording.mask import HAND, distance_to_lines
from pipeline.recording.reader import Recording, Stream, recording_of

ANY_BAND = SimpleNamespace(diameter=0.010, rest_length=0.52)  # where none is named
COVERED = 1.5  # diameters from a point of the cloud to the line, and that it stands for


@dataclass
class Topic:
    """One line of the table; times in seconds, None where the topic plays no role.

    Attributes:
        delay: Median of log_time - header.stamp.
        missing: Messages that a constant rate would have had in the gaps.
        lost: Damaged, not finite or doubled messages.
    """

    topic: str
    type: str
    messages: int
    role: str | None = None
    rate: float | None = None
    longest_gap: float | None = None
    missing: int | None = None
    lost: int | None = None
    delay: float | None = None


@dataclass
class Report:
    """Everything `sling check` says; `problem` is None where the recording can be used."""

    path: str
    sha256: str
    problem: str | None
    losses: list[str]
    topics: list[Topic]
    frames: dict[str, str] = field(default_factory=dict)
    signals: dict[str, object] = field(default_factory=dict)
    cloud: dict[str, object] = field(default_factory=dict)

    @property
    def usable(self) -> bool:
        return self.problem is None

    def to_json(self) -> str:
        content = {**asdict(self), "usable": self.usable}
        return json.dumps(content, indent=2, allow_nan=False)

    def to_text(self) -> str:
        lines = [f"{self.path}  sha256 {self.sha256[:16]}", "", *_table(self.topics)]
        for title in ("frames", "signals", "cloud"):
            facts = getattr(self, title)
            if facts:
                lines += ["", title, *(f"  {k:<22}{_shown(v)}" for k, v in facts.items())]
        lines += ["", *(f"lost: {loss}" for loss in self.losses)]
        lines.append("can be used" if self.usable else f"cannot be used: {self.problem}")
        return "\n".join(lines)


def check_recording(path: Path, params: object, band: object | None = None) -> Report:
    """Look at a recording as far as it can be read.

    Args:
        path: The MCAP file.
        params: The whole params.
        band: Has diameter and rest_length [m]; a common one if None.

    Raises:
        UserError: where there is no MCAP file to look at. Anything else is in the report.
    """
    container = read_container(Path(path))
    report = Report(str(path), sha256(path), None, container.losses, _topics(container))
    about = band or ANY_BAND
    try:
        recording = recording_of(container, params.setup)
        _add_roles(report.topics, recording)
        done = process_recording(recording, about, params)
    except UserError as error:
        report.problem = str(error).removeprefix(f"{path}: ")
        return report
    report.frames = done.geometry.sources
    report.signals = _signal_facts(done)
    report.cloud = _cloud_facts(done)
    if report.cloud["taut_coverage"] is None:
        report.problem = (
            f"no picture shows the band drawn taut at a rest length of {about.rest_length:g} m,"
            f" {'check it' if band else 'which is assumed here'}, or record a longer pull"
        )
    return report


def _topics(container: Container) -> list[Topic]:
    rows = [Topic(c.topic, c.schema.name, len(c.payloads)) for c in container.channels]
    return sorted(rows, key=lambda row: row.topic)


def _add_roles(topics: list[Topic], recording: Recording) -> None:
    by_name = {row.topic: row for row in topics}
    for role, stream in recording.streams.items():
        row = by_name[stream.topic]
        row.role, row.lost, row.delay = role, stream.lost, stream.delay
        row.rate, row.longest_gap, row.missing = _pace(stream)


def _pace(stream: Stream) -> tuple[float, float, int]:
    return 1 / stream.period, stream.longest_gap, stream.missing


def _signal_facts(done: Processed) -> dict[str, object]:
    signals, facts = done.signals, done.signals.facts
    lead_in = (signals.origin - int(done.recording.wrench.stamp[0])) * 1e-9
    return {
        "window_start_s": lead_in,
        "grasp_s": lead_in + signals.grasp_time,
        "release_s": lead_in + signals.release_time,
        "release_resolution_s": facts["release_resolution"],
        "bias_n": facts["bias"],
        "drift_n_s": facts["drift"],
        "noise_n": facts["noise"],
        "peak_force_n": facts["peak_force"],
        "hold_force_n": facts["hold_force"],
        "sign": "flipped" if facts["flipped"] else "as recorded",
        "turn_deg": float(np.degrees(facts["turn"])),
        "draw_m": signals.hand(signals.release_time).tolist(),
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


def coverage(done: Processed) -> tuple[float | None, float | None]:
    """How well the clouds see the drawn band, whose place is known: two lines, tip to hand.

    Returns:
        Share of the lines (without the fingers' part) that has points beside it, and the median
        distance of points from the lines [m], which is the band's radius where the calibration is
        right; None where the band was never taut.
    """
    scene, shares, offsets = done.scene, [], []
    for time, points in zip(done.clouds.time, done.clouds.points, strict=True):
        if not scene.taut(time) or not len(points):
            continue
        offsets.append(distance_to_lines(points, scene, time))
        for tip in scene.tips:
            way = scene.signals.hand(time) - tip
            length = np.linalg.norm(way)
            parts = np.arange(0.0, length - HAND, scene.diameter)[:, None] / length
            nearest = np.linalg.norm((tip + parts * way)[:, None] - points[None], axis=-1)
            shares.append(np.mean(nearest.min(axis=1) < COVERED * scene.diameter))
    if not shares:
        return None, None
    return float(np.mean(shares)), float(np.median(np.concatenate(offsets)))


def _table(topics: list[Topic]) -> list[str]:
    width = max([len(row.topic) for row in topics], default=5)
    head = ("role", "messages", "rate", "longest gap", "missing", "lost", "delay")
    rows = [f"{'topic':<{width}}  {head[0]:<8}" + "".join(f"{name:>13}" for name in head[1:])]
    for row in topics:
        cells = [str(row.messages)]
        if row.role:
            cells += [f"{row.rate:.1f} Hz", f"{1e3 * row.longest_gap:.1f} ms", str(row.missing)]
            cells += [str(row.lost), f"{1e3 * row.delay:+.1f} ms"]
        line = f"{row.topic:<{width}}  {row.role or '-':<8}"
        rows.append(line + "".join(f"{cell:>13}" for cell in cells))
    return rows


def _shown(value: object) -> str:
    if isinstance(value, list):
        return " ".join(f"{number:.4f}" for number in value)
    return f"{value:.4f}" if isinstance(value, float) else str(value)
