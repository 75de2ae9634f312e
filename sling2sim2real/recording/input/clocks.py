"""Header stamps against log_time: what is a clock's fault, and when that can be mended.

A message has two times: its header's stamp, when it was measured, and log_time, when the recorder
received it, which is later by a delay that jitters and at times piles up. Only the least delays of
a while are worth comparing. The rule, for each break in a topic:

| delay | stamps | it is |
|---|---|---|
| as before | leap ahead | a gap: kept, and said |
| changes for good | go on evenly | a step of log_time, or a slower network: nothing to mend |
| changes for good | leap by the same | a step of the stamps' clock: taken out |
| as before | go back, and log_time too | a step of the machine's clock: taken out |

A step is taken out by continuity: the message after it comes a whole number of periods after the
one before, that number given by log_time. So a topic needs an even rate; the step of another
topic is refused, as log_time alone is not good to a millisecond. Where several topics step at once,
the fastest one tells by how much. A lone stamp far from both of its neighbours is damage, and so
are one or two at the ends that log_time puts elsewhere.

A whole topic on another clock than the wrench's can be tied to it by log_time only as well as the
two transports' least delays agree: about a millisecond for what a controller publishes (pose,
gripper), which is put right, but tens of milliseconds for pictures, where a millisecond
costs 25 % of the damping: they are refused.

Delays of receipt do not grow by themselves, so where a topic's least delays change against the
wrench's all through the recording, its clock runs at another rate. That is taken out where it is
known to a millisecond over the recording; how late the stamps were at the first one is not known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter


@dataclass(frozen=True)
class ClockLimits:
    """Thresholds of clocks, each with its unit and what it is for."""

    step: float = 0.010  # s: a smaller step looks like a delay of receipt
    window: float = 1.0  # s of log_time on each side of a break, of which the least delay counts
    around: int = 3  # messages at least in that window
    even: float = 0.2  # of the period: intervals of an even rate differ by less, in the median
    piled: float = 0.2  # of the period: messages that had to wait come within it
    agree: float = 0.003  # s between a step by continuity and the same by log_time
    far: float = 1.0  # s from a stamp to those around it: it is damage
    alone: float = 60.0  # s from one or two messages at a topic's end to the rest: so are they
    disorder: int = 10  # messages that go back: nobody set a clock so often, the file has no order
    interleaved: int = 6  # times that two runs of messages alternate which cover the same time
    seconds: int = 5  # of least delays: a line through fewer tells no drift
    sure: float = 3.0  # standard errors from which a clock drifts
    drifted: float = 0.003  # s over the recording from which its drift matters
    known: float = 0.001  # s over the recording to which a rate must be known to be taken out
    tolerance: float = 0.5  # s between the clocks of two topics: transport and drivers take less


LIMITS = ClockLimits()


@dataclass(frozen=True)
class ClockRate:
    """A clock's rate against another's.

    Attributes:
        rate, error: By how much more time passes on it, and the standard error [s/s].
        span: Of the recording [s].
    """

    rate: float = 0.0
    error: float = np.inf
    span: float = 0.0

    @classmethod
    def of(
        cls, growth: tuple[float, float], reference: tuple[float, float], span: float
    ) -> ClockRate:
        """Make the rate from what `drift` returns for both topics."""
        rate = (1 - growth[0]) / (1 - reference[0]) - 1
        return cls(rate, float(np.hypot(growth[1], reference[1])), span)

    @property
    def matters(self) -> bool:
        """Whether it is sure, and more than nothing over the recording."""
        least = max(LIMITS.drifted, LIMITS.sure * self.error * self.span)
        return bool(np.isfinite(self.error)) and abs(self.rate) * self.span > least

    @property
    def taken_out(self) -> bool:
        """Whether it is known well enough to be better taken out."""
        return self.matters and self.error * self.span < LIMITS.known

    def without(self, stamp: np.ndarray) -> np.ndarray:
        """Stamps [ns] at the other clock's rate, as they were at the first one."""
        since = (stamp - stamp.min()) * (self.rate / (1 + self.rate))
        return stamp - np.round(since).astype(np.int64)


@dataclass(frozen=True)
class Jump:
    """A clock's step.

    Attributes:
        index: The first message after it, in the order of the arrays that were given.
        log: log_time there [ns].
        size: How far the stamps leapt, beside the time that passed [ns].
        period: Of the topic [ns].
        exact: Whether the rate is even enough to tell the size by continuity.
    """

    index: int
    log: int
    size: int
    period: int
    exact: bool


def outliers(stamp: np.ndarray, log: np.ndarray) -> np.ndarray:
    """Which stamps [ns], in the order of arrival, are far from all around them; shape (S,).

    By a running median of five, as Hampel's filter, with a fixed limit. At the ends of a topic
    these are also one or two that log_time has elsewhere, or that come a minute before or after all
    others: too few to tell of a clock.
    """
    if len(stamp) < 5:
        return np.zeros(len(stamp), bool)
    middle = np.median(stamp.astype(float))
    usual = median_filter(stamp - middle, 5, mode="nearest") + middle
    limit = max(LIMITS.far * 1e9, 10 * _period(stamp))
    far_off = np.abs(stamp - usual) > limit
    for order in (1, -1):
        retained = np.flatnonzero(~far_off)[::order]
        ways, by_log = np.abs(np.diff(stamp[retained])), np.abs(np.diff(log[retained]))
        elsewhere = np.abs(ways - by_log) > limit / 2
        far = ways > np.where(elsewhere, limit, max(LIMITS.alone * 1e9, limit))
        begin = 0
        for i in np.flatnonzero(far[: 2 * LIMITS.around]):
            if i + 1 - begin >= LIMITS.around or 2 * i > len(retained):
                break
            begin = i + 1
        far_off[retained[:begin]] = True
    return far_off


def arrival(stamp: np.ndarray, log: np.ndarray) -> np.ndarray:
    """The order in which messages came, shape (S,): the file's, or log_time's.

    The latter where chunks are in disorder: both times go back, and no clock was set (`rewinds`).
    Where log_time alone goes back, the recorder's clock was set.
    """
    disorder = len(_back(stamp, log)) > 0
    return np.argsort(log, kind="stable") if disorder else np.arange(len(stamp))


def steps(stamp: np.ndarray, log: np.ndarray) -> list[Jump]:
    """Steps of the stamps' clock alone, in a topic [ns], in the order of arrival.

    By a minimum filter of delays, as NTP's: the least delay before a break against that after it.
    """
    if len(stamp) < 2 * LIMITS.around:
        return []
    period, spread = _period(stamp), _spread(stamp)
    exact = spread < LIMITS.even * period
    arrived = np.maximum.accumulate(log)
    least = max(LIMITS.step * 1e9, 0.6 * period, 6 * spread)
    delay = log - stamp
    # Messages that had piled up come all at once; their delays say nothing of a clock.
    alone = np.diff(log, prepend=log[0] - period) > LIMITS.piled * period
    jumps: list[Jump] = []
    for i in np.flatnonzero(np.abs(np.diff(delay)) > least) + 1:
        last = jumps[-1].index if jumps else 0
        low = max(np.searchsorted(arrived, arrived[i] - LIMITS.window * 1e9), last)
        high = np.searchsorted(arrived, arrived[i] + LIMITS.window * 1e9, side="right")
        before, after = (delay[a:b][alone[a:b]] for a, b in ((low, i), (i, high)))
        if min(len(before), len(after)) < LIMITS.around:
            continue
        size = int(before.min() - after.min())
        way = int(stamp[i] - stamp[i - 1])
        leap = way - max(1, round((way - size) / period)) * period
        if min(abs(size), abs(way - period), abs(leap)) < least or (size > 0) != (way > period):
            continue  # delays, log_time's own step, or a gap
        agrees = abs(leap - size) < max(LIMITS.agree * 1e9, period / 4)
        leapt = round(leap if agrees else size)
        jumps.append(Jump(int(i), int(log[i]), leapt, period, exact and agrees))
    return jumps


def rewinds(stamp: np.ndarray, log: np.ndarray) -> list[Jump]:
    """Steps back of both clocks, in a topic [ns], in the order of the file.

    Chunks in another order go back too, but do not cover the same time twice. Nobody sets a clock
    as often as a file without any order goes back.
    """
    jumps, back = [], _back(stamp, log)
    for i in back if len(back) < LIMITS.disorder else ():
        before = stamp[:i][stamp[:i] >= stamp[i]]
        after = stamp[i:][stamp[i:] <= stamp[i - 1]]
        run = np.repeat([0, 1], [len(before), len(after)])
        order = np.argsort(np.concatenate([before, after]), kind="stable")
        if np.count_nonzero(np.diff(run[order])) >= LIMITS.interleaved:
            period = _period(stamp)
            size = int(stamp[i] - stamp[i - 1]) - period
            exact = _spread(stamp) < LIMITS.even * period
            jumps.append(Jump(int(i), int(log[i]), size, period, exact))
    return jumps


def without(stamp: np.ndarray, jumps: list[Jump], base: int = 0) -> np.ndarray:
    """Stamps on the clock that segment `base` (0: before the first step) has."""
    segment = segments(len(stamp), jumps)
    leaps = np.concatenate([[0], np.cumsum([step.size for step in jumps], dtype=np.int64)])
    return stamp - (leaps - leaps[base])[segment].astype(np.int64)


def segments(count: int, jumps: list[Jump]) -> np.ndarray:
    """Number of steps before each message, shape (count,)."""
    return np.searchsorted([step.index for step in jumps], np.arange(count), side="right")


def offset(
    stamp: np.ndarray, log: np.ndarray, other_stamp: np.ndarray, other_log: np.ndarray
) -> float:
    """Excess [s] of a topic's least delays over another's, where both have messages."""
    start = min(log.min(), other_log.min())
    mine, others = _least(stamp, log, start), _least(other_stamp, other_log, start)
    common = sorted({*mine} & {*others})
    if not common:
        return float((log - stamp).min() - (other_log - other_stamp).min()) * 1e-9
    return float(np.median([mine[stamped] - others[stamped] for stamped in common])) * 1e-9


def drift(stamp: np.ndarray, log: np.ndarray) -> tuple[float, float]:
    """Growth of the least delays [s/s], and its standard error; not known in a few seconds.

    A line by least squares through each second's least delay. Receipt is on the recorder's clock:
    only the difference of two topics says something.
    """
    least = _least(stamp, log, int(log.min()))
    if len(least) < LIMITS.seconds:
        return 0.0, np.inf
    time, delay = np.array(list(least), float), np.array(list(least.values())) * 1e-9
    slope, start = np.polyfit(time, delay, 1)
    noise = np.sum((delay - start - slope * time) ** 2) / (len(time) - 2)
    return float(slope), float(np.sqrt(noise / np.sum((time - time.mean()) ** 2)))


def of_one_clock(drifts: list[tuple[float, float]]) -> tuple[float, float]:
    """The mean of what topics say whose messages travel together, as `drift` has it."""
    least = min(error for _, error in drifts)
    weights = [max(error, 1e-9) ** -2.0 for _, error in drifts]
    if not np.isfinite(least):
        return 0.0, np.inf
    return float(np.average([rate for rate, _ in drifts], weights=weights)), least


def _back(stamp: np.ndarray, log: np.ndarray) -> np.ndarray:
    """Messages at which both times go back, by about as much."""
    way, way_by_log = np.diff(stamp), np.diff(log)
    both = np.maximum(way, way_by_log) < -LIMITS.step * 1e9
    return np.flatnonzero(both & (np.abs(way - way_by_log) < -way_by_log / 2)) + 1


def _least(stamp: np.ndarray, log: np.ndarray, start: int) -> dict[int, int]:
    """Least delay in each second of log_time."""
    second, delay = (log - start) // 10**9, log - stamp
    order = np.lexsort([delay, second])
    keys, first = np.unique(second[order], return_index=True)
    return dict(zip(keys.tolist(), delay[order][first].tolist(), strict=True))


def _period(stamp: np.ndarray) -> int:
    ways = np.diff(stamp)
    ways = ways[ways > 0]
    return max(1, int(np.median(ways))) if len(ways) else 1


def _spread(stamp: np.ndarray) -> float:
    """Median by which intervals differ from the period [ns]."""
    return float(np.median(np.abs(np.diff(stamp) - _period(stamp))))
