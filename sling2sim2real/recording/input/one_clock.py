"""All topics on the wrench's clock: what each one's stamps tell by themselves, and then a vote.

`clocks` and `pace` find what is wrong in one topic. Here topics are compared: a step that several
make at once has the size that the fastest of them tells, and the segment of a topic that goes with
the others is the right one. The order matters: what looks like a step may be a set machine clock,
damage or a burst, which come out first; offsets and rates are told by what is left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import chain

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.input import clocks, pace
from sling2sim2real.recording.input.raw import Raw
from sling2sim2real.recording.input.roles import CAMERAS

CORRECTABLE = ("pose", "gripper")  # by log_time, if they have a clock of their own
TWIN_TIME, TWIN_SIZE = 0.5e9, 5e6  # ns by which one step differs between two topics, at most


def put_on_one_clock(topics: dict[str, Raw], late: Mapping[str, float]) -> None:
    """Mend the stamps of all topics in place, and note what was mended.

    Args:
        topics: By role.
        late: By what the stamps of a role are known to be late [s], which is taken off.

    Raises:
        UserError: for a topic whose clock cannot be mended, in one line.
    """
    _take_rewinds_out(topics)
    for raw in topics.values():
        raw.disorder = int(np.count_nonzero(np.diff(raw.stamp) < 0))
        raw.keep(clocks.arrival(raw.stamp, raw.log))
        raw.drop(clocks.outliers(raw.stamp, raw.log), "far off in time")
        _take_bursts_out(raw)
    _take_steps_out(topics)
    for role, seconds in late.items():
        if role in topics:
            topics[role].stamp = topics[role].stamp - round(seconds * 1e9)
    _on_one_clock(topics, late)
    _at_one_rate(topics)


def _take_rewinds_out(topics: dict[str, Raw]) -> None:
    """Steps back of the machine's clock, stamps and log_time alike."""
    for role, jumps in _agreed(topics, clocks.rewinds).items():
        raw = topics[role]
        raw.stamp = clocks.without(raw.stamp, jumps)
        raw.log = clocks.without(raw.log, jumps)
        for step in jumps:
            at, size = (raw.log[step.index] - raw.log[0]) * 1e-9, step.size * 1e-9
            what = f"step of its machine's clock of {size:+.4f} s at {at:.2f} s taken out"
            raw.notes.append(what)


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


def _take_steps_out(topics: dict[str, Raw]) -> None:
    """Steps of the stamps' clock alone; the segment that fits the other topics is right.

    It is the one whose least delay of receipt is nearest to the median of those of topics without a
    step, or else to that of its own longest segment.
    """
    agreed = _agreed(topics, clocks.steps)
    start = min(raw.log.min() for raw in topics.values())
    steady = [raw for role, raw in topics.items() if role not in agreed]
    sound = [(raw.log - raw.stamp).min() for raw in steady]
    for role, jumps in agreed.items():
        raw = topics[role]
        segment, delay = clocks.segments(len(raw.stamp), jumps), raw.log - raw.stamp
        least = [delay[segment == k].min() for k in range(len(jumps) + 1)]
        usual = np.median(sound or [least[np.argmax(np.bincount(segment))]])
        base = int(np.argmin(np.abs(np.array(least, float) - usual)))
        raw.stamp = clocks.without(raw.stamp, jumps, base)
        for step in jumps:
            at, size = (step.log - start) * 1e-9, step.size * 1e-9
            raw.notes.append(f"clock step of {size:+.4f} s at {at:.2f} s taken out")
        raw.disorder -= sum(step.size < 0 for step in jumps)


def _agreed(
    topics: dict[str, Raw], find: Callable[[np.ndarray, np.ndarray], list[clocks.Jump]]
) -> dict[str, list[clocks.Jump]]:
    """Steps of each role; those at one time have the size that the fastest topic tells."""
    jumps = {role: find(raw.stamp, raw.log) for role, raw in topics.items()}
    jumps = {role: steps for role, steps in jumps.items() if steps}
    for role, steps in jumps.items():
        for k, step in enumerate(steps):
            twins = [
                other
                for other in chain.from_iterable(jumps.values())
                if abs(other.size - step.size) < max(other.period, step.period, TWIN_SIZE)
                and abs(other.log - step.log) < TWIN_TIME
            ]
            best = min(twins, key=lambda twin: (not twin.exact, twin.period))
            if not best.exact and role not in CORRECTABLE:
                raise UserError(
                    f"the clock of {topics[role].topic} steps by {step.size * 1e-9:+.3f} s,"
                    " and its rate is too uneven to tell by how much exactly: record again without"
                    " setting clocks"
                )
            steps[k] = replace(step, size=best.size)
    return jumps


def _on_one_clock(topics: dict[str, Raw], late: Mapping[str, float]) -> None:
    """Topics on another clock than the wrench's, by their least delays of receipt.

    What controllers publish is put right; force and pictures that differ among themselves are
    refused, and the message names that which is furthest from the median of all topics.
    """
    wrench = topics["wrench"]
    offsets = {
        role: clocks.offset(raw.stamp, raw.log, wrench.stamp, wrench.log)
        for role, raw in topics.items()
    }
    middle = float(np.median(list(offsets.values())))
    needed = {role: middle - offsets[role] for role in offsets if role not in CORRECTABLE}
    if np.ptp(list(needed.values())) > clocks.LIMITS.tolerance:
        worst, off = max(needed.items(), key=lambda pair: abs(pair[1]))
        raise UserError(
            f"the stamps of {topics[worst].topic} are {off:+.3f} s off the other topics'"
            f" clock, record all topics with one clock{_camera_cure(offsets, late)}"
        )
    for role in CORRECTABLE:
        if role in topics and abs(offsets[role]) > clocks.LIMITS.tolerance:
            topics[role].stamp = topics[role].stamp + round(offsets[role] * 1e9)
            topics[role].notes.append(
                f"on another clock: {offsets[role]:+.3f} s added to its stamps by log_time, good to"
                " about a millisecond"
            )


def _at_one_rate(topics: dict[str, Raw]) -> None:
    """The other topics' clocks against the wrench's; colour and depth have one."""
    drifts = {role: clocks.drift(raw.stamp, raw.log) for role, raw in topics.items()}
    drifts |= dict.fromkeys(CAMERAS, clocks.of_one_clock([drifts[role] for role in CAMERAS]))
    reference, span = drifts.pop("wrench"), float(np.ptp(topics["wrench"].stamp)) * 1e-9
    for role, growth in drifts.items():
        raw = topics[role]
        raw.drift = clocks.ClockRate.of(growth, reference, span)
        if raw.drift.taken_out:
            raw.stamp = raw.drift.without(raw.stamp)


def _camera_cure(offsets: dict[str, float], late: Mapping[str, float]) -> str:
    """The delay that puts pictures on the force's clock; "" where the cameras' clocks differ."""
    pictures = [late.get(offset, 0.0) - offsets[offset] for offset in offsets if offset in CAMERAS]
    if not pictures or np.ptp(pictures) > clocks.LIMITS.tolerance:
        return ""
    return (
        f"; or set episode.delays.camera: {np.mean(pictures):.3f} in params.yaml, by the times of"
        " receipt, which is good to some hundredths of a second alone"
    )
