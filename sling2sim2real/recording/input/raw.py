"""One topic as it was read, message by message, in the order of the file."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.input import clocks, pace
from sling2sim2real.recording.input.decode import Elsewhere, Unreadable
from sling2sim2real.recording.input.readings import Picture
from sling2sim2real.recording.input.roles import Choice
from sling2sim2real.recording.input.words import shortened

ABSURD = 1e6  # N, m, m/s, rad: nothing here is as large
TIMED = ("gripper",)  # roles for which log_time will do where there are no stamps
REASON = 100  # characters of why a message is damaged


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
    disorder: int = 0  # how often the stamps go back
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

    def words(self) -> str:
        """How many messages were lost, and why."""
        words = ", ".join(f"{count} {why}" for why, count in sorted(self.lost.items()))
        return f"{words}; the first damaged one: {self.reason}" if self.reason else words


def read_raw(role: str, choice: Choice) -> Raw:
    """Read a topic's messages. Raises UserError where fewer than two are left."""
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
        reasons = f" ({raw.words()})" if raw.lost else ""
        raise UserError(f"topic {raw.topic} has fewer than two readable messages{reasons}")
    return raw
