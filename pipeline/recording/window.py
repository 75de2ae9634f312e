"""The stretch of a recording that becomes the episode, and the means over its samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.base.errors import UserError
from pipeline.episode import signal
from pipeline.recording.events import MARGIN
from pipeline.recording.input.reader import Recording, Stream

MOST_GAP = 0.3  # s over which force and pose may be interpolated


@dataclass(frozen=True)
class Window:
    """As much lead-in as the tail after the release leaves room for.

    Attributes:
        origin: Zero of the times here [ns].
        start: When it begins [s].
        period, samples: Length [s] of each sample, and how many there are.
        gaps: Longest time without a message [s], by topic.
    """

    origin: int
    start: float
    period: float
    samples: int
    gaps: dict[str, float]

    @classmethod
    def of(cls, recording: Recording, grasp: float, release: float, episode: object) -> Window:
        """Of wrench and pose, with seconds since the first force. Raises UserError."""
        origin = int(recording.wrench.stamp[0])
        start = _start(recording, origin, grasp, release, episode)
        gaps = {
            stream.topic: _longest_gap(stream, origin, start, start + episode.duration)
            for stream in (recording.wrench, recording.pose)
        }
        for topic, gap in gaps.items():
            if gap > MOST_GAP:
                raise UserError(
                    f"{topic} is missing for {gap:.2f} s between the lead-in and the end: more than"
                    f" {MOST_GAP:g} s cannot be filled in, record again"
                )
        return cls(origin, start, episode.duration / episode.samples, episode.samples, gaps)

    def mean(self, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Of values (S, ...) at increasing times (S,) [s], over each sample: (samples, ...)."""
        return signal.average(times, values, self.start, self.period, self.samples)


def _start(
    recording: Recording, origin: int, grasp: float, release: float, episode: object
) -> float:
    t, pose_t = recording.wrench.seconds(origin), recording.pose.seconds(origin)
    first, last = max(t[0], pose_t[0]), min(t[-1], pose_t[-1])
    ends = recording.wrench.topic if t[-1] < pose_t[-1] else recording.pose.topic
    start = max(first, release + episode.tail - episode.duration)
    slack = 1.5 * max(recording.wrench.period, recording.pose.period)
    if start + episode.duration > last + slack:
        if last < release + episode.tail:
            side = "after" if last >= release else "before"
            raise UserError(
                f"{ends} ends {abs(last - release):.2f} s {side} the release, episode.tail asks"
                f" for {episode.tail} s after it: record on for longer"
            )
        raise UserError(
            f"it is {last - first:.2f} s long, episode.duration asks for {episode.duration} s:"
            " record for longer"
        )
    if start > grasp - MARGIN:
        raise UserError(
            f"from grasp to release it takes {release - grasp:.2f} s, more than episode.duration"
            f" {episode.duration} s less episode.tail {episode.tail} s: pull faster, or set them"
        )
    return start


def _longest_gap(stream: Stream, origin: int, start: float, end: float) -> float:
    """Between samples of a window [s]; values are interpolated over it."""
    times = stream.seconds(origin)
    inside = times[(times > start) & (times < end)]
    return float(np.diff(inside).max()) if len(inside) > 1 else end - start
