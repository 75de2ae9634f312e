"""How a topic's messages follow on one another: stamps that come in bursts, values that repeat.

A driver that empties a buffer stamps all that is in it at once: an FTDI chip hands over what came
within 16 ms. The samples were taken at an even rate before that, and are put back there.

A publisher that is faster than its source sends each value again until there is a new one. Between
two values the truth moves on: a value held is late by half of the hold, on average. Only the first
message of each value has its time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.errors import UserError

CLOSE = 0.25  # of the mean way between messages: what is nearer is of one burst
MOST_CLOSE = 0.4  # share of such ways from which they are no accident
TWINS = 0.5  # share of bursts of one and the same value, from which messages are doubled
LONGEST = 1.6  # usual lengths of a burst: what is further back was lost
HELD = 1.8  # mean ways between messages from which a value is held
ALIKE, MOST_ALIKE = 0.25, 0.7  # by which share holds differ, and how many of them by no more
REST = 3.0  # median holds: a value that stays for longer is at rest
LEAST_HOLDS = 10
SKIPPED = 3  # longest ways, which may be gaps of any length
GAP = 10.0  # usual ways: what is longer is a gap
EVEN = 0.1  # of the period, by which the median way may differ from the mean one
COARSE = 0.001  # by which steps of one resolution differ


@dataclass(frozen=True)
class Bursts:
    """Stamps that came in bursts.

    Attributes:
        count: Messages in one, in the median.
        interval: Between two of them [ns].
        error: Standard deviation of the even stamps [ns].
    """

    count: int
    interval: float
    error: float


def without_bursts(
    topic: str, stamp: np.ndarray, log: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, Bursts] | None:
    """Stamps at an even rate within each burst, and what the bursts were; None of even ones.

    Args:
        stamp, log: In the order of arrival [ns], shape (S,).
        values: Shape (S, C).

    Raises:
        UserError: Those of one stamp are received one by one: the topic's clock ticks coarsely.
    """
    ways = np.diff(stamp)
    if len(stamp) < 20:
        return None
    mean = mean_way(ways)
    close = np.abs(ways) < CLOSE * mean
    if close.mean() < MOST_CLOSE:
        return None
    first = np.flatnonzero(np.concatenate([[True], ~close]))
    last = np.append(first[1:], len(stamp)) - 1
    new = np.any(np.diff(values, axis=0, prepend=values[:1]) != 0, axis=1)
    inside = np.add.reduceat(new, first) - new[first] > 0
    if np.sum(new[first] & ~inside) > TWINS * np.sum(new[first]):
        return None
    counts = last - first + 1
    count = int(np.median(counts))
    if np.median((log[last] - log[first])[counts == count]) >= CLOSE * mean * (count - 1):
        raise UserError(
            f"{topic}: its clock ticks every {np.median(np.diff(stamp[last])) * 1e-6:.3g} ms only:"
            " stamp each message when it is measured (of a simulator, publish its clock more often)"
        )
    between = np.diff(stamp[last]).astype(float)
    interval = float(np.median(between))
    usual = float(np.median(between / counts[1:]))  # between samples
    spans = np.append(0.0, between)  # those before a burst's end
    spans = np.where((spans > 0) & (spans < LONGEST * counts * usual), spans, counts * usual)
    burst = np.repeat(np.arange(len(first)), counts)
    share = (np.arange(len(stamp)) - first[burst] + 1) / counts[burst] - 1
    even = stamp[last][burst] + np.round(share * spans[burst]).astype(np.int64)
    jitter = float(np.std(between[np.abs(between - interval) < interval / 2]))
    return even, Bursts(count, interval, max(jitter, usual / np.sqrt(12)))


def hold_of(stamp: np.ndarray, values: np.ndarray) -> float | None:
    """Time for which each value is repeated [ns]; None where they are not held alike for long.

    Args:
        stamp: Increasing [ns], shape (S,).
        values: Shape (S, C).
    """
    ways, change = np.diff(stamp), np.diff(values, axis=0)
    new = stamp[1:][np.any(change != 0, axis=1)]
    holds = np.diff(new).astype(float)
    if len(holds) < LEAST_HOLDS or _steps_alike(change):
        return None
    mean = mean_way(ways)
    for _ in range(2):  # without what is at rest, which may be most of the time
        holds = holds[holds <= REST * np.median(holds)]
    hold = float(np.median(holds))
    alike = np.abs(holds - hold) <= max(ALIKE * hold, 0.6 * mean)
    if hold < HELD * mean or alike.mean() < MOST_ALIKE:
        return None
    return float(holds[alike].mean())


def _steps_alike(change: np.ndarray) -> bool:
    """A coarse encoder changes by its resolution, whenever the hand has come that far."""
    moves = change[:, np.argmax(np.count_nonzero(change, axis=0))]
    sizes = np.abs(moves[moves != 0])
    return bool(np.median(np.abs(sizes / np.median(sizes) - 1)) < COARSE)


def first_of_each(stamp: np.ndarray, values: np.ndarray, hold: float) -> np.ndarray:
    """Which messages to keep, shape (S,): new values, and those at rest once in a hold."""
    new = np.concatenate([[True], np.any(np.diff(values, axis=0) != 0, axis=1)])
    # Since the value was new, in holds that are over.
    since = (stamp - stamp[np.flatnonzero(new)[np.cumsum(new) - 1]]) / hold
    over = np.floor(since + 1e-6)
    return new | (np.diff(over, prepend=-1) > 0)


def mean_way(ways: np.ndarray) -> float:
    """Mean time between stamps [ns], of times between them (S,), without gaps.

    Of bursts nearly all ways are short: what is a gap is told by the ways that half of the time
    is spent in, but for the few longest.
    """
    some = np.sort(np.abs(ways))[: max(len(ways) - SKIPPED, 1)]
    passed = np.cumsum(some, dtype=float)
    usual = some[int(np.searchsorted(passed, passed[-1] / 2))]
    return max(float(np.mean(ways[ways <= GAP * usual])), 1.0)


def period_of(ways: np.ndarray) -> float:
    """Usual time between messages [ns]: the median, or where that is none, the mean."""
    median, mean = float(np.median(ways)), mean_way(ways)
    return median if abs(median - mean) < EVEN * mean else mean
