"""One topic's messages to a `Stream`: read, put on one clock, sorted, and what was lost said.

The rules of the clocks are in `clocks`. A message is lost where it cannot be read, is not finite or
absurdly large, has no stamp or one far from its neighbours', names another frame than the rest, has
the stamp of another, or, of force and pose, is alone far off those around it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from pipeline.base.errors import UserError, printable
from pipeline.recording.input import clocks, pace
from pipeline.recording.input.decode import Elsewhere, Unreadable
from pipeline.recording.input.readings import Picture
from pipeline.recording.input.roles import OPTIONAL, Choice
from pipeline.recording.input.stream import Stream, frozen, gaps_of
from pipeline.recording.input.words import counted, shortened

ABSURD = 1e6  # N, m, m/s, rad: nothing here is as large
# What a lone message may be off the four around it: a knock or a fall lasts for more than one.
LONE = {"wrench": 30.0, "pose": 0.05}  # N, m
MOST_LONE = 0.05  # share of the messages that may be alone: more are the sensor's noise, or units
FASTEST = 2.0  # m/s of the hand
TIMED = ("gripper",)  # roles for which log_time will do where there are no stamps
REASON = 100  # characters of why a message is damaged
CAMERAS = ("color", "depth")
HELD = ("wrench", "pose", "twist")  # roles of which each value is measured anew
CORRECTABLE = ("pose", "twist", "gripper")  # by log_time, if they have a clock of their own


@dataclass
class Raw:
    """One topic as it was read, in the order of the file."""

    role: str
    choice: Choice
    frame: str
    stamp: np.ndarray
    log: np.ndarray
    values: list[Any]
    lost: Counter[str]
    reason: str = ""  # why the first damaged message cannot be read
    notes: list[str] = field(default_factory=list)
    late: int = 0  # how often the stamps go back
    bursts: pace.Bursts | None = None
    drift: clocks.ClockRate = clocks.ClockRate()

    @property
    def topic(self) -> str:
        return self.choice.channel.topic

    def keep(self, which: np.ndarray) -> None:
        """Only these messages: a mask or an order."""
        self.stamp, self.log = self.stamp[which], self.log[which]
        places = np.flatnonzero(which) if which.dtype == bool else which
        self.values = [self.values[i] for i in places]

    def drop(self, which: np.ndarray, why: str) -> None:
        if which.any():
            self.lost[why] += int(which.sum())
            self.keep(~which)


def streams_of(
    chosen: dict[str, Choice], late: Mapping[str, float] | None = None
) -> tuple[dict[str, Stream[Any]], list[str]]:
    """All topics on the wrench's clock, and remarks on what costs nothing.

    Args:
        chosen: Choices of wrench, pose, color, depth, and of twist and gripper if there are.
        late: By what the stamps of a role are known to be late [s], which is taken off.

    Raises:
        UserError: for a topic that cannot be used, in one line.
    """
    raw, notes = {}, []
    for role, choice in chosen.items():
        try:
            raw[role] = _read(role, choice)
        except UserError as error:
            if role not in OPTIONAL:
                raise
            notes.append(f"{error}: done without it")
    _take_rewinds_out(raw)
    for series in raw.values():
        series.late = int(np.count_nonzero(np.diff(series.stamp) < 0))
        series.keep(clocks.arrival(series.stamp, series.log))
        series.drop(clocks.outliers(series.stamp, series.log), "far off in time")
        _take_bursts_out(series)
    _take_steps_out(raw)
    late = {} if late is None else late
    for role, seconds in late.items():
        if role in raw:
            raw[role].stamp = raw[role].stamp - round(seconds * 1e9)
    _on_one_clock(raw, late)
    _at_one_rate(raw)
    streams = {role: _sorted(samples) for role, samples in raw.items()}
    origin = int(streams["wrench"].stamp[0])
    first = min(stream.stamp[0] for stream in streams.values())
    last = max(stream.stamp[-1] for stream in streams.values())
    for stream in streams.values():
        stream.notes.extend(gaps_of(stream, origin, first, last))
    return streams, notes + frozen(streams, origin)


def _read(role: str, choice: Choice) -> Raw:
    stamps, logs, values, frames, lost = [], [], [], [], Counter()
    seen, bare, reason = set(), 0, ""
    channel = choice.channel
    for log_time, payload in zip(channel.log_times, channel.payloads, strict=True):
        try:
            stamp, frame, value = choice.read(payload)
        except Elsewhere:
            continue
        except Unreadable as error:
            lost["damaged"] += 1
            reason = reason or shortened(printable(str(error)), REASON)
            continue
        if (log_time, payload) in seen:
            lost["doubled"] += 1
            continue
        seen.add((log_time, payload))
        if not isinstance(value, Picture) and not all(abs(x) < ABSURD for x in value):
            lost["not finite"] += 1
            continue
        if not stamp:
            bare += 1
            stamp = 0
        stamps.append(stamp)
        logs.append(log_time)
        values.append(value)
        frames.append(frame)
    frame = Counter(frames).most_common(1)[0][0] if frames else ""
    stamp, log = np.array(stamps, np.int64), np.array(logs, np.uint64).astype(np.int64)
    raw = Raw(role, choice, frame, stamp, log, values, lost, reason)
    if bare == len(stamps) > 0:
        if role not in TIMED:
            raise UserError(f"topic {raw.topic} has no header stamps, record with time stamps")
        raw.stamp = log.copy()
        raw.notes.append("no header stamps: log_time is used")
    raw.drop(np.array([other != frame for other in frames], bool), "in another frame")
    raw.drop(raw.stamp == 0, "without a stamp")
    if len(raw.stamp) < 2:
        reasons = f" ({_words(raw)})" if raw.lost else ""
        raise UserError(f"topic {raw.topic} has fewer than two readable messages{reasons}")
    return raw


def _take_rewinds_out(raw: dict[str, Raw]) -> None:
    """Steps back of the machine's clock, stamps and log_time alike."""
    for series, jumps in _agreed(raw, clocks.rewinds).items():
        role = raw[series]
        role.stamp = clocks.without(role.stamp, jumps)
        role.log = clocks.without(role.log, jumps)
        for step in jumps:
            at, size = (role.log[step.index] - role.log[0]) * 1e-9, step.size * 1e-9
            role.notes.append(
                f"step of its machine's clock of {size:+.4f} s at {at:.2f} s taken out"
            )


def _take_bursts_out(raw: Raw) -> None:
    """Stamps of buffers that are read at once, or of a coarse clock."""
    if raw.role in CAMERAS:
        return
    even = pace.without_bursts(raw.stamp, raw.log, np.array(raw.values, float))
    if even is None:
        return
    raw.stamp, raw.bursts = even
    side = "before" if raw.bursts.before else "after"
    raw.notes.append(
        f"stamped in bursts of {raw.bursts.count} every {raw.bursts.interval * 1e-6:.3g} ms: spread"
        f" evenly over the time {side} each"
    )


def _take_steps_out(raw: dict[str, Raw]) -> None:
    """Steps of the stamps' clock alone; the segment that fits the other topics is right."""
    agreed = _agreed(raw, clocks.steps)
    start = min(series.log.min() for series in raw.values())
    usual = {}
    for role, samples in raw.items():
        segment = clocks.segments(len(samples.stamp), agreed.get(role, []))
        longest = np.argmax(np.bincount(segment))
        usual[role] = (samples.log - samples.stamp)[segment == longest].min()
    for role, jumps in agreed.items():
        samples = raw[role]
        segment = clocks.segments(len(samples.stamp), jumps)
        least = [(samples.log - samples.stamp)[segment == k].min() for k in range(len(jumps) + 1)]
        others = np.median([usual[other] for other in raw if other not in agreed] or [usual[role]])
        base = int(np.argmin(np.abs(np.array(least, float) - others)))
        samples.stamp = clocks.without(samples.stamp, jumps, base)
        for step in jumps:
            at, size = (step.log - start) * 1e-9, step.size * 1e-9
            samples.notes.append(f"clock step of {size:+.4f} s at {at:.2f} s taken out")
        samples.late -= sum(step.size < 0 for step in jumps)


def _agreed(
    raw: dict[str, Raw], find: Callable[[np.ndarray, np.ndarray], list[clocks.Jump]]
) -> dict[str, list[clocks.Jump]]:
    """Steps of each role; those at one time have the size that the fastest topic tells."""
    jumps = {role: find(series.stamp, series.log) for role, series in raw.items()}
    jumps = {role: steps for role, steps in jumps.items() if steps}
    for role, steps in jumps.items():
        for k, step in enumerate(steps):
            twins = [
                other
                for others in jumps.values()
                for other in others
                if abs(other.size - step.size) < max(other.period, step.period, 5_000_000)
                and abs(other.log - step.log) < 0.5e9
            ]
            best = min(twins, key=lambda twin: (not twin.exact, twin.period))
            if not best.exact and role not in CORRECTABLE:
                raise UserError(
                    f"the clock of {raw[role].topic} steps by {step.size * 1e-9:+.3f} s,"
                    " and its rate is too uneven to tell by how much exactly: record again without"
                    " setting clocks"
                )
            steps[k] = replace(step, size=best.size)
    return jumps


def _on_one_clock(raw: dict[str, Raw], late: Mapping[str, float]) -> None:
    wrench = raw["wrench"]
    offsets = {
        role: clocks.offset(series.stamp, series.log, wrench.stamp, wrench.log)
        for role, series in raw.items()
    }
    middle = float(np.median(list(offsets.values())))
    needed = {role: middle - offsets[role] for role in offsets if role not in CORRECTABLE}
    if np.ptp(list(needed.values())) > clocks.TOLERANCE:
        worst, off = max(needed.items(), key=lambda pair: abs(pair[1]))
        raise UserError(
            f"the stamps of {raw[worst].topic} are {off:+.3f} s off the other topics'"
            f" clock, record all topics with one clock{_camera_cure(offsets, late)}"
        )
    for role in CORRECTABLE:
        if role in raw and abs(offsets[role]) > clocks.TOLERANCE:
            raw[role].stamp = raw[role].stamp + round(offsets[role] * 1e9)
            raw[role].notes.append(
                f"on another clock: {offsets[role]:+.3f} s added to its stamps by log_time, good to"
                " about a millisecond"
            )


def _at_one_rate(raw: dict[str, Raw]) -> None:
    """The other topics' clocks against the wrench's; colour and depth have one."""
    drifts = {role: clocks.drift(series.stamp, series.log) for role, series in raw.items()}
    drifts |= dict.fromkeys(CAMERAS, clocks.of_one_clock([drifts[role] for role in CAMERAS]))
    reference, span = drifts.pop("wrench"), float(np.ptp(raw["wrench"].stamp)) * 1e-9
    for role, growth in drifts.items():
        samples = raw[role]
        samples.drift = clocks.ClockRate.of(growth, reference, span)
        if samples.drift.taken_out:
            samples.stamp = samples.drift.without(samples.stamp)


def _camera_cure(offsets: dict[str, float], late: Mapping[str, float]) -> str:
    """The delay that puts pictures on the force's clock; "" where the cameras' clocks differ."""
    pictures = [late.get(offset, 0.0) - offsets[offset] for offset in offsets if offset in CAMERAS]
    if not pictures or np.ptp(pictures) > clocks.TOLERANCE:
        return ""
    return (
        f"; or set episode.delays.camera: {np.mean(pictures):.3f} in params.yaml, by the times of"
        " receipt, which is good to some hundredths of a second alone"
    )


def _sorted(raw: Raw) -> Stream[Any]:
    if raw.late > 0:
        raw.notes.append(f"{counted(raw.late)} out of order, sorted by stamp")
    raw.keep(np.argsort(raw.stamp, kind="stable"))
    raw.drop(np.diff(raw.stamp, prepend=raw.stamp[0] - 1) == 0, "with the stamp of another")
    if len(raw.stamp) < 2:
        raise UserError(f"topic {raw.topic} has fewer than two readable messages")
    values: Any = raw.values
    if not isinstance(values[0], Picture):
        values = np.array(values, float)
        if raw.role in LONE and raw.choice.convert is None:
            values = _without_lone(raw, values)
        if raw.choice.convert is not None:
            values = raw.choice.convert(raw.stamp, values)
    hold = pace.hold_of(raw.stamp, values) if raw.role in HELD else None
    if hold:
        retained = pace.first_of_each(raw.stamp, values, hold)
        times = f"{len(values) / np.count_nonzero(retained):.0f}"
        raw.notes.append(f"each value is sent {times} times: the repeats are left out")
        raw.keep(retained)
        values = values[retained]
    if raw.lost:
        raw.notes.append(f"lost {_words(raw)}")
    delay = np.median(raw.log - raw.stamp) * 1e-9
    extras = sum(raw.lost.values()), raw.notes, raw.bursts, (hold or 0.0) * 1e-9, raw.drift
    return Stream(raw.topic, raw.frame, raw.stamp, values, float(delay), *extras)


def _without_lone(raw: Raw, values: np.ndarray) -> np.ndarray:
    """Without single values of force or place far from those around them, shape (S, C)."""
    around = median_filter(values[:, :3], (5, 1), mode="nearest")
    limit = LONE[raw.role]
    if raw.role == "pose":
        limit = max(limit, FASTEST * 1e-9 * float(np.median(np.diff(raw.stamp))))
    lone = np.abs(values[:, :3] - around).max(axis=1) > limit
    if lone.mean() > MOST_LONE:
        return values
    raw.drop(lone, "far off those around")
    return values[~lone]


def _words(raw: Raw) -> str:
    words = ", ".join(f"{count} {why}" for why, count in sorted(raw.lost.items()))
    return f"{words}; the first damaged one: {raw.reason}" if raw.reason else words
