"""What to know of a topic's stream that cost nothing: gaps, ends, and values that never change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.recording.input.words import few

if TYPE_CHECKING:
    from pipeline.recording.input.streams import Stream

LONG_GAP, LONG_GAP_S = 5.0, 0.02  # periods and seconds from which a gap is named
ENDS = 0.3  # s by which a topic may start later or stop earlier than the others
FROZEN = 0.25  # s of one and the same value of a sensor that has noise
FROZEN_FRAMES = 3  # pictures that are the same, byte for byte
NAMED = 3  # places named in one line


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
