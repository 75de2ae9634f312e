"""All topics' messages to `Stream`s: read, put on one clock, sorted, and what was lost said.

A message is lost where it cannot be read, is not finite or absurdly large, has no stamp or one far
from its neighbours', names another frame than the rest, has the stamp of another, or, of force and
pose, is alone far off those around it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

import numpy as np
from scipy.ndimage import median_filter

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.input import pace
from sling2sim2real.recording.input.one_clock import put_on_one_clock
from sling2sim2real.recording.input.raw import Raw, read_raw
from sling2sim2real.recording.input.readings import Picture
from sling2sim2real.recording.input.roles import OPTIONAL, Choice
from sling2sim2real.recording.input.stream import Stream, frozen, gaps_of
from sling2sim2real.recording.input.words import counted

# What a lone message may be off the four around it: a knock or a fall lasts for more than one.
LONE = {"wrench": 30.0, "pose": 0.05}  # N, m
MOST_LONE = 0.05  # share of the messages that may be alone: more are the sensor's noise, or units
FASTEST = 2.0  # m/s of the hand
HELD = ("wrench", "pose")  # roles of which each value is measured anew

Value = TypeVar("Value")


def streams_of(
    chosen: dict[str, Choice], late: Mapping[str, float] | None = None
) -> tuple[dict[str, Stream[Any]], list[str]]:
    """All topics on the wrench's clock, and remarks on what costs nothing.

    Args:
        chosen: Choices of wrench, pose, color, depth, and of gripper if there is one.
        late: By what the stamps of a role are known to be late [s], which is taken off.

    Raises:
        UserError: for a topic that cannot be used, in one line.
    """
    notes: list[str] = []
    topics = _usable(
        {role: partial(read_raw, role, choice) for role, choice in chosen.items()}, notes
    )
    put_on_one_clock(topics, late or {})
    streams = _usable({role: partial(_sorted, raw) for role, raw in topics.items()}, notes)
    origin = int(streams["wrench"].stamp[0])
    first = min(stream.stamp[0] for stream in streams.values())
    last = max(stream.stamp[-1] for stream in streams.values())
    for stream in streams.values():
        stream.notes.extend(gaps_of(stream, origin, first, last))
    return streams, notes + frozen(streams, origin)


def _usable(made: Mapping[str, Callable[[], Value]], notes: list[str]) -> dict[str, Value]:
    """What is made of each role, without the optional roles of which nothing can be made."""
    results = {}
    for role, make in made.items():
        try:
            results[role] = make()
        except UserError as error:
            if role not in OPTIONAL:
                raise
            notes.append(f"{error}: done without it")
    return results


def _sorted(raw: Raw) -> Stream[Any]:
    if raw.disorder > 0:
        raw.notes.append(f"{counted(raw.disorder)} out of order, sorted by stamp")
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
            values = raw.choice.convert(values)
    hold = pace.hold_of(raw.stamp, values) if raw.role in HELD else None
    if hold:
        retained = pace.first_of_each(raw.stamp, values, hold)
        times = f"{len(values) / np.count_nonzero(retained):.0f}"
        raw.notes.append(f"each value is sent {times} times: the repeats are left out")
        raw.keep(retained)
        values = values[retained]
    if raw.lost:
        raw.notes.append(f"lost {raw.words()}")
    delay = np.median(raw.log - raw.stamp) * 1e-9
    extras = sum(raw.lost.values()), raw.notes, raw.bursts, (hold or 0.0) * 1e-9, raw.drift
    return Stream(raw.topic, raw.frame, raw.stamp, values, float(delay), *extras)


def _without_lone(raw: Raw, values: np.ndarray) -> np.ndarray:
    """Without single values of force or place far from those around them, shape (S, C).

    By a running median of five, as Hampel's filter, with a fixed limit.
    """
    around = median_filter(values[:, :3], (5, 1), mode="nearest")
    limit = LONE[raw.role]
    if raw.role == "pose":
        limit = max(limit, FASTEST * 1e-9 * float(np.median(np.diff(raw.stamp))))
    lone = np.abs(values[:, :3] - around).max(axis=1) > limit
    if lone.mean() > MOST_LONE:
        return values
    raw.drop(lone, "far off those around")
    return values[~lone]
