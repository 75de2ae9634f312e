"""Which of several topics belong together: those of one device, and those that move together.

Two arms may be in one recording, sensors that are dead, and joints of two devices in one topic. A
topic's *side* is the word in which it differs from a topic like it (left, right; arm 1, arm 2); the
force that falls is the one that let go of the band; the hand's pose is the one whose steps the
force follows; the gripper is the one whose fingers move when the force falls.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from pipeline.recording.input.contents import Channel
from pipeline.recording.input.decode import Unreadable
from pipeline.recording.input.readings import Picture, Reading

LOOKED_AT = 2000  # messages of a topic
FEW = 60  # messages that tell whether anything changes
OPPOSITE = ({"left", "right"}, {"l", "r"})
AROUND = 5  # messages before and after a fall
SUDDEN = 8.0  # times the usual change from which one is a fall
FREE = 0.5  # share of the held force that may be left by a fall
STEPS = 150  # of time, in which force and hand are compared
FOLLOWS = 0.5  # of the best share of the force's steps that a hand's explain
AT_FALL = 0.5  # s after the fall in which fingers open
MOVES = 0.3  # of the largest movement: fingers that move less are another device's
ALIKE = 0.9  # correlation of fingers that move as one


@dataclass(frozen=True)
class Track:
    """What some messages of a topic say, in the order of the file.

    Attributes:
        time: When they were logged [s], shape (N,).
        stamp: Of their headers [ns], 0 where there is none, shape (N,).
        values: Shape (N, C).
    """

    time: np.ndarray
    stamp: np.ndarray
    values: np.ndarray


def track_of(
    channel: Channel, read: Callable[[bytes], Reading], most: int = LOOKED_AT
) -> Track | None:
    """Track of at most so many messages, evenly spread; None where fewer than two can be read."""
    count = len(channel.payloads)
    times, stamps, values = [], [], []
    for k in np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int)):
        try:
            stamp, _, value = read(channel.payloads[k])
        except Unreadable:
            continue
        if isinstance(value, Picture):
            value = (float(hash(value.data.tobytes())),)
        if all(np.isfinite(value)):
            times.append(channel.log_times[k] * 1e-9)
            stamps.append(stamp or 0)
            values.append(value)
    if len(values) < 2:
        return None
    return Track(np.array(times), np.array(stamps, np.int64), np.array(values, float))


def alive(channel: Channel, read: Callable[[bytes], Reading]) -> bool:
    """Whether what the messages say ever changes."""
    track = track_of(channel, read, FEW)
    return track is not None and bool(np.ptp(track.values, axis=0).any())


def sides_of(topics: Iterable[tuple[str, str]]) -> list[set[str]]:
    """Words by which topics of one type differ that are otherwise alike; of (topic, type)."""
    pairs = list(OPPOSITE)
    for (a, kind), (b, other) in combinations(topics, 2):
        first, two = _words(a), _words(b)
        if kind != other or len(first) != len(two):
            continue
        apart = [{x, y} for x, y in zip(first, two, strict=True) if x != y]
        if len(apart) == 1 and apart[0] not in pairs:
            pairs.append(apart[0])
    return pairs


def apart(first: Iterable[str], other: Iterable[str], sides: Sequence[set[str]]) -> bool:
    """Whether two topics are of different devices, by their names and their frames' names."""
    a, b = ({word for name in names for word in _words(name)} for names in (first, other))
    return any(a & side and b & side and not a & b & side for side in sides)


def fall_of(track: Track) -> int | None:
    """Number of the message at which a force (N, 3) falls for good, as of a band that is let go."""
    force = track.values[:, :3]
    if len(force) < 6 * AROUND:
        return None
    windows = np.lib.stride_tricks.sliding_window_view(force, AROUND, axis=0)
    level = np.median(windows, axis=-1)  # of the messages from i to i + AROUND
    before, after = level[:-AROUND], level[AROUND:]
    change = np.linalg.norm(after - before, axis=1)
    rest = np.median(force[: max(AROUND, len(force) // 50)], axis=0)
    held, left = (np.linalg.norm(some - rest, axis=1) for some in (before, after))
    change = np.where(left < FREE * held, change, 0.0)
    k = int(np.argmax(change))
    usual = np.median(np.linalg.norm(after - before, axis=1))
    return k + AROUND if change[k] > SUDDEN * max(usual, 1e-9) else None


def follows(force: Track, hand: Track) -> float:
    """Share of the steps of a force (N, 3) that those of a hand's place (N, 3) explain, 0 to 1."""
    fall = fall_of(force)
    end = force.time[fall - 1] if fall else force.time[-1]
    edges = np.linspace(max(force.time[0], hand.time[0]), min(end, hand.time[-1]), STEPS + 1)
    if not edges[-1] > edges[0]:
        return 0.0
    f, x = (_means(track, edges) for track in (force, hand))
    finite = np.isfinite(f).all(axis=1) & np.isfinite(x).all(axis=1)
    if finite.sum() < STEPS / 3:
        return 0.0
    df, dx = np.diff(f[finite], axis=0), np.diff(x[finite], axis=0)
    left = df - dx @ np.linalg.lstsq(dx, df, rcond=None)[0]
    total = float((df**2).sum())
    return max(0.0, 1.0 - float((left**2).sum()) / total) if total > 0 else 0.0


def moves_at(fingers: Track, fall: float) -> bool:
    """Whether fingers (N, C) move within half a second of `fall` [s], by when they were logged."""
    away = _moved(fingers.values, fingers.time - fall)
    least = np.maximum(0.2 * np.ptp(fingers.values, axis=0), 1e-9)
    return away is not None and bool((away > least).any())


def opening_of(
    values: np.ndarray, moments: np.ndarray, fall: Callable[[], int | None]
) -> np.ndarray:
    """Opening of the hand that let go, shape (S, 1), from the positions of fingers (S, C).

    Fingers of a mirrored sign count the other way round, those of another device not at all.

    Args:
        values: Positions.
        moments: Their stamps [ns], shape (S,).
        fall: When the force falls, by its stamp [ns]; asked for where fingers differ.
    """
    if values.shape[1] == 1 or _alike(values):
        return values.sum(axis=1, keepdims=True)
    moved = np.ptp(values, axis=0)
    when = fall()
    at_fall = None if when is None else _moved(values, (moments - when) * 1e-9)
    if at_fall is not None and (at_fall > MOVES * moved).any():
        moved = at_fall
    largest = int(np.argmax(moved))
    middle = values - values.mean(axis=0)
    sign = np.where(middle.T @ middle[:, largest] < 0, -1.0, 1.0)
    return (values * sign)[:, moved >= MOVES * moved[largest]].sum(axis=1, keepdims=True)


def _moved(values: np.ndarray, since: np.ndarray) -> np.ndarray | None:
    """How far fingers (S, C) move from where they held, (C,), by times since the fall (S,) [s]."""
    held, after = (since > -1.0) & (since < 0), (since > 0) & (since < AT_FALL)
    if not held.any() or not after.any():
        return None
    return np.abs(values[after] - np.median(values[held], axis=0)).max(axis=0)


def _alike(values: np.ndarray) -> bool:
    """Whether all columns move as one."""
    spread = values.std(axis=0)
    if not spread.all():
        return not spread.any()
    return bool((np.corrcoef(values.T) > ALIKE).all())


def _means(track: Track, edges: np.ndarray) -> np.ndarray:
    """Means of the first three values between edges (K + 1,), NaN where nothing is, (K, 3)."""
    bins = np.searchsorted(edges, track.time, side="right") - 1
    inside = (bins >= 0) & (bins < len(edges) - 1)
    count = np.bincount(bins[inside], minlength=len(edges) - 1)
    sums = [np.bincount(bins[inside], v[inside], len(edges) - 1) for v in track.values[:, :3].T]
    with np.errstate(invalid="ignore"):
        return np.stack(sums, axis=1) / np.where(count > 0, count, np.nan)[:, None]


def _words(name: str) -> list[str]:
    return re.findall("[a-z]+|[0-9]+", name.lower())
