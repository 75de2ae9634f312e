"""One topic's messages, sorted by stamp; gaps in them, and values that never change."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import numpy as np

from sling2sim2real.recording.input import pace
from sling2sim2real.recording.input.clocks import ClockRate
from sling2sim2real.recording.input.readings import Picture
from sling2sim2real.recording.input.words import few

LONG_GAP, LONG_GAP_S = 5.0, 0.02  # periods and seconds from which a gap is named
ENDS = 0.3  # s by which a topic may start later or stop earlier than the others
FROZEN = 0.25  # s of one and the same value of a sensor that has noise
FROZEN_FRAMES = 3  # pictures that are the same, byte for byte
NAMED = 3  # places named in one line
EVEN = 0.1  # of the period, by which the median way may differ from the mean one

Values = TypeVar("Values", np.ndarray, list[Picture])


@dataclass(frozen=True)
class Stream(Generic[Values]):
    """One topic, sorted by stamp.

    Attributes:
        topic: Its name.
        frame: frame_id of its messages.
        stamp: header.stamp, ns, shape (S,), strictly increasing.
        values: One column a quantity, shape (S, C), or `Picture`s, length S.
        receipt_delay: Median of log_time - stamp [s].
        lost: Messages that are not in it, for whatever reason.
        notes: What was lost or mended, in words.
        bursts: In which the stamps came; None where they were even.
        hold: For how long each value was repeated [s], 0 where it was not: repeats are left out.
        drift: Of its clock against the wrench's, by the times of receipt.
    """

    topic: str
    frame: str
    stamp: np.ndarray
    values: Values
    receipt_delay: float
    lost: int
    notes: list[str] = field(default_factory=list)
    bursts: pace.Bursts | None = None
    hold: float = 0.0
    drift: ClockRate = ClockRate()

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
        """Copy with `seconds` subtracted from every stamp."""
        return replace(self, stamp=self.stamp - round(seconds * 1e9)) if seconds else self


def gaps_of(stream: Stream[Any], origin: int, first: int, last: int) -> list[str]:
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


def frozen(streams: dict[str, Stream[Any]], origin: int) -> list[str]:
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
