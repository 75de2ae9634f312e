"""One topic's messages to a `Stream`: read, put on one clock, sorted, and what was lost said.

The rules of the clocks are in `clocks`. A message is lost where it cannot be read, is not finite or
absurdly large, has no stamp or one far from its neighbours', names another frame than the rest, has
the stamp of another, or, of force and pose, is alone far off those around it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import numpy as np
from scipy.ndimage import median_filter

from pipeline.base.errors import UserError, printable
from pipeline.recording.input import clocks, pace
from pipeline.recording.input.decode import Unreadable
from pipeline.recording.input.readings import Picture
from pipeline.recording.input.roles import OPTIONAL, Choice
from pipeline.recording.input.words import counted, few, shortened

ABSURD = 1e6  # N, m, m/s, rad: nothing here is as large
# What a lone message may be off the four around it: a knock or a fall lasts for more than one.
LONE = {"wrench": 30.0, "pose": 0.05}  # N, m
MOST_LONE = 0.05  # share of the messages that may be alone: more are the sensor's noise, or units
FASTEST = 2.0  # m/s of the hand
TIMED = ("gripper",)  # roles for which log_time will do where there are no stamps
LONG_GAP, LONG_GAP_S = 5.0, 0.02  # periods and seconds from which a gap is named
ENDS = 0.3  # s by which a topic may start later or stop earlier than the others
FROZEN = 0.25  # s of one and the same value of a sensor that has noise
FROZEN_FRAMES = 3  # pictures that are the same, byte for byte
EVEN = 0.1  # of the period, by which the median way may differ from the mean one
NAMED = 3  # places named in one line
REASON = 100  # characters of why a message is damaged
CAMERAS = ("color", "depth")
HELD = ("wrench", "pose", "twist")  # roles of which each value is measured anew
CORRECTABLE = ("pose", "twist", "gripper")  # by log_time, if they have a clock of their own


Values = TypeVar("Values", np.ndarray, list[Picture])


@dataclass(frozen=True)
class Stream(Generic[Values]):
    """One topic, sorted by stamp.

    Attributes:
        topic: Its name.
        frame: frame_id of its messages.
        stamp: header.stamp, ns, shape (S,), strictly increasing.
        values: One column a quantity, shape (S, C), or `Picture`s, length S.
        delay: Median of log_time - stamp [s].
        lost: Messages that are not in it, for whatever reason.
        notes: What was lost or mended, in words.
        bursts: In which the stamps came; None where they were even.
        hold: For how long each value was repeated [s], 0 where it was not: repeats are left out.
        drift: Growth of log_time - stamp [s/s], and its standard error.
    """

    topic: str
    frame: str
    stamp: np.ndarray
    values: Values
    delay: float
    lost: int
    notes: list[str] = field(default_factory=list)
    bursts: pace.Bursts | None = None
    hold: float = 0.0
    drift: tuple[float, float] = (0.0, np.inf)

    def seconds(self, origin: int) -> np.ndarray:
        return (self.stamp - origin) * 1e-9

    @property
    def period(self) -> float:
        """Usual time between messages [s]: the median, or where that is none, the mean."""
        ways = np.diff(self.stamp)
        median, mean = float(np.median(ways)), pace.mean_way(ways)
        return (median if abs(median - mean) < EVEN * mean else mean) * 1e-9

    @property
    def longest_gap(self) -> float:
        return float(np.max(np.diff(self.stamp))) * 1e-9

    @property
    def missing(self) -> int:
        """Messages that a constant rate would have had in the gaps."""
        gaps = np.diff(self.stamp) * 1e-9 / self.period
        return int(np.sum(np.maximum(np.round(gaps) - 1, 0)))

    def between(self, first: int, last: int) -> Stream[Values]:
        """Messages stamped from `first` to `last` [ns]; the nearest two where there are fewer."""
        begin = min(int(np.searchsorted(self.stamp, first)), len(self.stamp) - 2)
        end = max(int(np.searchsorted(self.stamp, last, side="right")), begin + 2)
        return replace(self, stamp=self.stamp[begin:end], values=self.values[begin:end])

    def shifted(self, seconds: float) -> Stream[Values]:
        """With `seconds` subtracted from every stamp."""
        return replace(self, stamp=self.stamp - round(seconds * 1e9)) if seconds else self


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


def streams_of(chosen: dict[str, Choice]) -> tuple[dict[str, Stream[Any]], list[str]]:
    """All topics on the wrench's clock, and remarks on what costs nothing.

    Args:
        chosen: Choices of wrench, pose, color, depth, and of twist and gripper if there are.

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
    for one in raw.values():
        one.late = int(np.count_nonzero(np.diff(one.stamp) < 0))
        one.keep(clocks.arrival(one.stamp, one.log))
        one.drop(clocks.outliers(one.stamp, one.log), "far off in time")
        _take_bursts_out(one)
    _take_steps_out(raw)
    _on_one_clock(raw)
    streams = {role: _sorted(one) for role, one in raw.items()}
    origin = int(streams["wrench"].stamp[0])
    first = min(stream.stamp[0] for stream in streams.values())
    last = max(stream.stamp[-1] for stream in streams.values())
    for stream in streams.values():
        stream.notes.extend(_gaps(stream, origin, first, last))
    return streams, notes + _frozen(streams, origin)


def _read(role: str, choice: Choice) -> Raw:
    stamps, logs, values, frames, lost = [], [], [], [], Counter()
    seen, bare, reason = set(), 0, ""
    channel = choice.channel
    for log_time, payload in zip(channel.log_times, channel.payloads, strict=True):
        try:
            stamp, frame, value = choice.read(payload)
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
    raw.drop(np.array([one != frame for one in frames], bool), "in another frame")
    raw.drop(raw.stamp == 0, "without a stamp")
    if len(raw.stamp) < 2:
        reasons = f" ({_words(raw)})" if raw.lost else ""
        raise UserError(f"topic {raw.topic} has fewer than two readable messages{reasons}")
    return raw


def _take_rewinds_out(raw: dict[str, Raw]) -> None:
    """Steps back of the machine's clock, stamps and log_time alike."""
    for one, found in _agreed(raw, clocks.rewinds).items():
        role = raw[one]
        role.stamp = clocks.without(role.stamp, found)
        role.log = clocks.without(role.log, found)
        for step in found:
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
    found = _agreed(raw, clocks.steps)
    start = min(one.log.min() for one in raw.values())
    usual = {}
    for role, one in raw.items():
        segment = clocks.segments(len(one.stamp), found.get(role, []))
        longest = np.argmax(np.bincount(segment))
        usual[role] = (one.log - one.stamp)[segment == longest].min()
    for role, jumps in found.items():
        one = raw[role]
        segment = clocks.segments(len(one.stamp), jumps)
        least = [(one.log - one.stamp)[segment == k].min() for k in range(len(jumps) + 1)]
        others = np.median([usual[other] for other in raw if other not in found] or [usual[role]])
        base = int(np.argmin(np.abs(np.array(least, float) - others)))
        one.stamp = clocks.without(one.stamp, jumps, base)
        for step in jumps:
            at, size = (step.log - start) * 1e-9, step.size * 1e-9
            one.notes.append(f"clock step of {size:+.4f} s at {at:.2f} s taken out")
        one.late -= sum(step.size < 0 for step in jumps)


def _agreed(
    raw: dict[str, Raw], find: Callable[[np.ndarray, np.ndarray], list[clocks.Jump]]
) -> dict[str, list[clocks.Jump]]:
    """Steps of each role; those at one time have the size that the fastest topic tells."""
    found = {role: find(one.stamp, one.log) for role, one in raw.items()}
    found = {role: steps for role, steps in found.items() if steps}
    for role, steps in found.items():
        for k, step in enumerate(steps):
            twins = [
                other
                for others in found.values()
                for other in others
                if abs(other.size - step.size) < max(other.period, step.period, 5_000_000)
                and abs(other.log - step.log) < 0.5e9
            ]
            best = min(twins, key=lambda one: (not one.exact, one.period))
            if not best.exact and role not in CORRECTABLE:
                raise UserError(
                    f"the clock of {raw[role].topic} steps by {step.size * 1e-9:+.3f} s,"
                    " and its rate is too uneven to tell by how much exactly: record again without"
                    " setting clocks"
                )
            steps[k] = replace(step, size=best.size)
    return found


def _on_one_clock(raw: dict[str, Raw]) -> None:
    wrench = raw["wrench"]
    offsets = {
        role: clocks.offset(one.stamp, one.log, wrench.stamp, wrench.log)
        for role, one in raw.items()
    }
    middle = float(np.median(list(offsets.values())))
    needed = {role: middle - offsets[role] for role in offsets if role not in CORRECTABLE}
    if np.ptp(list(needed.values())) > clocks.TOLERANCE:
        worst, off = max(needed.items(), key=lambda one: abs(one[1]))
        raise UserError(
            f"the stamps of {raw[worst].topic} are {off:+.3f} s off the other topics'"
            " clock, record all topics with one clock"
        )
    for role in CORRECTABLE:
        if role in raw and abs(offsets[role]) > clocks.TOLERANCE:
            raw[role].stamp = raw[role].stamp + round(offsets[role] * 1e9)
            raw[role].notes.append(
                f"on another clock: {offsets[role]:+.3f} s added to its stamps by log_time, good to"
                " about a millisecond"
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
        kept = pace.first_of_each(raw.stamp, values, hold)
        times = f"{len(values) / np.count_nonzero(kept):.0f}"
        raw.notes.append(f"each value is sent {times} times: the repeats are left out")
        raw.keep(kept)
        values = values[kept]
    if raw.lost:
        raw.notes.append(f"lost {_words(raw)}")
    delay, drift = np.median(raw.log - raw.stamp) * 1e-9, clocks.drift(raw.stamp, raw.log)
    about = sum(raw.lost.values()), raw.notes, raw.bursts, (hold or 0.0) * 1e-9, drift
    return Stream(raw.topic, raw.frame, raw.stamp, values, float(delay), *about)


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


def _gaps(stream: Stream[Any], origin: int, first: int, last: int) -> list[str]:
    """Long gaps, and ends that lack what the other topics have."""
    notes, ways = [], np.diff(stream.stamp) * 1e-9
    late, early = (stream.stamp[0] - first) * 1e-9, (last - stream.stamp[-1]) * 1e-9
    least = max(ENDS, LONG_GAP * stream.period)
    if late > least:
        notes.append(f"starts {late:.2f} s after the others")
    if early > least:
        notes.append(f"stops {early:.2f} s before the others")
    long = np.flatnonzero(ways > max(LONG_GAP * stream.period, LONG_GAP_S))
    if len(long):
        at = stream.seconds(origin)
        named = [f"{ways[i]:.3f} s at {at[i]:.2f} s" for i in long[np.argsort(-ways[long])]]
        notes.append(f"gap{'s' * (len(long) > 1)} of {few(named, NAMED)}")
    return notes


def _frozen(streams: dict[str, Stream[Any]], origin: int) -> list[str]:
    """Sensors that repeat themselves, which those with noise do not."""
    remarks = []
    for role in ("wrench", "color", "depth"):
        stream = streams[role]
        if role == "wrench":
            same = np.all(np.diff(stream.values, axis=0) == 0, axis=1)
            least = max(FROZEN_FRAMES, round(FROZEN / stream.period))
        else:
            data = [picture.data for picture in stream.values]
            same = np.array([np.array_equal(a, b) for a, b in zip(data, data[1:], strict=False)])
            least = FROZEN_FRAMES - 1
        run = _longest_run(same)
        if run and run[1] >= least:
            at = stream.seconds(origin)[run[0]]
            remarks.append(
                f"{stream.topic}: the same value {run[1] + 1} times from {at:.2f} s on: was the"
                " sensor frozen?"
            )
    return remarks


def _longest_run(same: np.ndarray) -> tuple[int, int] | None:
    """Start and length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]])))
    starts, lengths = edges[::2], edges[1::2] - edges[::2]
    return (int(starts[np.argmax(lengths)]), int(lengths.max())) if len(lengths) else None
