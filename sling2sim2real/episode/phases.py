"""Phases of an interaction, as its motion and force show them, not as anybody planned it.

The drawn distance is the hand's from the fork's middle. While the band is slack nothing is a phase.
From it and the force's rise follow

    loading     the hand draws the band further than ever before
    unloading   it lets the drawn band back
    reloading   it draws again what was drawn before
    pause       it rests, and the band relaxes
    recoil      the hand let go, until a picture shows the band's middle past the fork
    swing       after that
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode

# Hands that hold a drawn band wander: by 2 mm at most in the recordings that we have. Tracking is
# as good, so that a way back of five times as much is meant.
TURN = 0.01  # m
STILL, REST = 0.008, 0.3  # m/s, and s: a hand that is slower for so long pauses
SPEED = 0.15  # s over which a speed is taken
MIDDLE = 0.03  # the middle of the band: points this near the plane x = 0 [m]
LONGEST_RECOIL = 0.2  # after the release [s]; soft bands cross the fork plane within 0.1
TAUT = 0.05  # of the peak force, above the band's weight: below it the band is slack
# What a recording must hold to tell a property of the rubber apart from its prior.
BACK = 0.02  # m of unloading
PAUSE = 0.5  # s
OTHER_SPEED = 2.0  # times another speed of the hand
LEAST_WAY = 0.03  # m on which a speed tells
MOVES = "loading", "unloading", "reloading"
NO_UNLOADING = "no unloading"


class HandSignals(Protocol):
    """A hand that holds a band: an `Episode`, or the signals of one that is to be."""

    @property
    def time(self) -> np.ndarray: ...
    @property
    def position(self) -> np.ndarray: ...
    @property
    def force(self) -> np.ndarray: ...
    @property
    def grasp_time(self) -> float: ...
    @property
    def release_time(self) -> float: ...


@dataclass(frozen=True)
class InteractionPhase:
    """A part of an interaction.

    Attributes:
        kind: As the table above has it.
        begin, end: [s].
        start, stop: Drawn distance at both [m], of the band's middle after the release.
    """

    kind: str
    begin: float
    end: float
    start: float
    stop: float

    @property
    def duration(self) -> float:
        return self.end - self.begin

    @property
    def way(self) -> float:
        """[m], never negative."""
        return abs(self.stop - self.start)

    @property
    def speed(self) -> float:
        """Mean speed [m/s]."""
        return self.way / max(self.duration, 1e-9)


def phases(episode: Episode) -> list[InteractionPhase]:
    """All of an episode, by time; gaps are slack. None of them where the force never rises."""
    by_hand = phases_of_hand(episode)
    if not by_hand:
        return []
    drawn, release = by_hand[-1].stop, float(episode.release_time)
    recoil = np.flatnonzero(taut_frames(episode))
    after = episode.cloud_time > release
    after[recoil] = False
    over = float(min([release + LONGEST_RECOIL, *episode.cloud_time[after]]))
    end = float(max([episode.time[-1] + episode.sample_period / 2, *episode.cloud_time, over]))
    last = ("recoil", release, over, drawn, 0.0), ("swing", over, end, 0.0, 0.0)
    return [*by_hand, *(InteractionPhase(*fields) for fields in last)]


def phases_of_hand(held: HandSignals) -> list[InteractionPhase]:
    """Phases from grasp to release, by time."""
    taut = taut_samples(held)
    if not taut.any():
        return []
    during = (held.time > held.grasp_time) & (held.time < held.release_time)
    time = held.time[during]
    drawn = np.linalg.norm(held.position[during], axis=1)
    slack = drawn[np.argmax(taut[during])]  # a slack band's middle is nowhere further
    drawn = np.maximum(drawn, slack)
    names = _names(time, drawn, slack)
    ends = np.flatnonzero(np.diff(names)) + 1
    result: list[InteractionPhase] = []
    for first, last in zip([0, *ends], [*ends, len(time)], strict=True):
        until = last if last < len(time) else last - 1
        end = float(time[until]) if last < len(time) else float(held.release_time)
        if names[first] != SLACK:
            by_motion = InteractionPhase(
                "", float(time[first]), end, float(drawn[first]), float(drawn[until])
            )
            deepest = max([slack, *(phase.stop for phase in result)])
            part = slice(first, until + 1)
            named = list(_named(by_motion, names[first], time[part], drawn[part], deepest))
            if (
                not named and result and result[-1].end == by_motion.begin
            ):  # a jerk ends what it follows
                last_one = result.pop()
                named = [replace(last_one, end=by_motion.end, stop=by_motion.stop)]
            result += named
    return _joined(result)


SLACK, RESTS = -2, -1  # beside the numbers of ways


def _names(time: np.ndarray, drawn: np.ndarray, slack: float) -> np.ndarray:
    """Names of samples, (T,): which of the hand's ways each belongs to, RESTS or SLACK."""
    names = np.searchsorted(turns(drawn)[1:-1], np.arange(len(drawn)), side="right")
    names[drawn <= slack] = SLACK
    period = (time[-1] - time[0]) / max(len(time) - 1, 1)
    size = max(3, 2 * round(SPEED / period / 2) + 1)
    if len(drawn) < size:
        return names
    from scipy.signal import savgol_filter  # which takes half a second

    speed = np.asarray(savgol_filter(drawn, size, 1, deriv=1, delta=period))
    slow = np.abs(speed) < STILL
    slow &= names != SLACK
    edges = np.flatnonzero(np.diff(np.concatenate([[0], slow, [0]])))
    for first, last in edges.reshape(-1, 2):
        if (last - first) * period >= REST:
            names[first:last] = RESTS
    return names


def _named(
    phase: InteractionPhase, name: int, time: np.ndarray, drawn: np.ndarray, deepest: float
) -> Iterator[InteractionPhase]:
    """A run of samples as a phase, or as reloading and loading where it does both."""
    if name == RESTS:
        yield InteractionPhase("pause", phase.begin, phase.end, phase.start, phase.stop)
    elif phase.way < TURN / 2:
        return
    elif phase.stop < phase.start:
        yield InteractionPhase("unloading", phase.begin, phase.end, phase.start, phase.stop)
    elif phase.stop < deepest + TURN / 2:
        yield InteractionPhase("reloading", phase.begin, phase.end, phase.start, phase.stop)
    elif phase.start > deepest - TURN / 2:
        yield InteractionPhase("loading", phase.begin, phase.end, phase.start, phase.stop)
    else:
        at = float(time[np.argmax(drawn >= deepest)])
        yield InteractionPhase("reloading", phase.begin, at, phase.start, deepest)
        yield InteractionPhase("loading", at, phase.end, deepest, phase.stop)


def _joined(separate: list[InteractionPhase]) -> list[InteractionPhase]:
    """Pauses that only jerks part are one."""
    joined: list[InteractionPhase] = []
    for phase in separate:
        last = joined[-1] if joined else phase
        if joined and last.kind == phase.kind == "pause":
            joined[-1] = InteractionPhase("pause", last.begin, phase.end, last.start, phase.stop)
        else:
            joined.append(phase)
    return joined


def turns(way: np.ndarray) -> list[int]:
    """Samples at which a way (T,) turns by TURN or more, with the first and the last one.

    It grows at first.
    """
    places, extreme, sign = [0], 0, 1.0
    for i, place in enumerate(way):
        further = sign * (place - way[extreme])
        if further >= 0:
            extreme = i
        elif -further > TURN:
            places.append(extreme)
            extreme, sign = i, -sign
    return [*places, len(way) - 1]


def unseen(seen_phases: Sequence[InteractionPhase]) -> dict[str, str]:
    """What a recording with these phases lacks, and what therefore keeps its prior."""
    moves = [phase.speed for phase in seen_phases if phase.kind in MOVES and phase.way >= LEAST_WAY]
    back = any(phase.kind == "unloading" and phase.way >= BACK for phase in seen_phases)
    pauses = any(phase.kind == "pause" and phase.duration >= PAUSE for phase in seen_phases)
    speeds = bool(moves) and max(moves) > OTHER_SPEED * min(moves)
    return {
        what: keeps
        for shown, what, keeps in (
            (back, NO_UNLOADING, "softening and hysteresis, so the energy that a launch gets back"),
            (pauses, f"no pause of {PAUSE:g} s", "slow relaxation"),
            (speeds, "one speed alone", "how the force depends on speed"),
        )
        if not shown
    }


def taut_samples(held: HandSignals) -> np.ndarray:
    """Which samples (T,) show a force on the hand beyond the band's weight, until the release."""
    size = np.linalg.norm(held.force, axis=1)
    during = (held.time > held.grasp_time) & (held.time < held.release_time)
    if not during.any():
        return during
    peak, weight = size[during].max(), np.median(size[during][:30])
    return during & (size > TAUT * peak + min(1.5 * weight, 0.2 * peak))


def taut_time(episode: Episode) -> float:
    """Time at which the hand's force begins to rise [s]. Raises UserError where it never does."""
    taut = taut_samples(episode)
    if not taut.any():
        raise UserError(f"episode of {episode.band}: the hand's force never rises")
    return float(episode.time[np.argmax(taut)])


def taut_frames(episode: Episode) -> np.ndarray:
    """Which camera frames show the released band on its way to the fork plane, shape (K,).

    Decided by the measured clouds alone, so that it is the same for every theta: from the release
    on, until a frame shows the middle of the band at y >= 0. A frame that does not show the middle
    decides nothing.
    """
    taut = np.zeros(len(episode.cloud_time), bool)
    for frame in np.argsort(episode.cloud_time):
        after = episode.cloud_time[frame] - episode.release_time
        if after <= 0:
            continue
        cloud = episode.clouds[frame]
        middle = cloud[np.abs(cloud[:, 0]) < MIDDLE, 1]
        if after > LONGEST_RECOIL or (len(middle) and np.median(middle) >= 0):
            break
        taut[frame] = True
    return taut
