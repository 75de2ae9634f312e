"""The events of a recording: its pulls, and the grasp and the release of each.

Labs record several pulls into one file: the hand lets go, returns, and grasps again. A pull's part
of the file begins when the hand is free of the pull before and ends when it grasps for the next
one: the free hand between two pulls ends the one and leads in the other. Each part has a grasp, a
release, a tare and delays of its own, and is judged by itself.

The grasp: thresholds on the fingers' stroke, or on the lift. Fingers report in whatever unit, and
some numbers grow when the fingers close: thresholds are shares of the stroke, and the sign is read
from what they did before they held.

The release is a change point of the force that lasts and leaves the hand free. First roughly: peaks
of the difference of means over two windows, before and after, known as the MOSUM statistic (moving
sums). Then, around the one that is the release, the onset of the fall between samples, as a mean
over all straight falls that may have been. What tells the release from slips and knocks stands in
`ReleaseLimits`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.motion import Motion, expect_dense
from sling2sim2real.recording.streams import Recording

Opening = tuple[np.ndarray, np.ndarray]  # of the gripper: times [s] and opening, both (G,)

MARGIN = 0.05  # s kept clear of the grasp and of the release when means are taken
LEAST_LEAD_IN = 0.2  # s of the empty hand before the grasp, at least: the force is tared there
SETTLE = 0.4  # s after the release until the hand is free and at rest
CALM = 3.0  # s after a release until the band hangs at rest again, to some 2 mm
APART = 1.0  # s: what is let go twice within this is one pull, and not understood
OPENING = 0.006  # s: pads open in less, and rubber follows them at once


@dataclass(frozen=True)
class Part:
    """What was recorded of one pull, and where things stand.

    Attributes:
        recording: The streams.
        geometry: Static transforms.
        number, count: Which of the file's pulls this is, from 1 on, and of how many.
    """

    recording: Recording
    geometry: Geometry
    number: int = 1
    count: int = 1


@dataclass(frozen=True)
class Pull(Part):
    """One pull and its events. Times are seconds since the file's first force.

    Attributes:
        opening: Times [s] and opening of the gripper; None where it was not recorded.
        motion: Of the hand.
        release: The end of the pull.
        grasp: Time at which the band is grasped [s].
    """

    opening: Opening | None = field(kw_only=True)
    motion: Motion = field(kw_only=True)
    release: Release = field(kw_only=True)
    grasp: float = field(kw_only=True)

    @classmethod
    def of(cls, part: Part) -> Pull:
        """Find the events of a pull. Raises UserError where the recording does not show them."""
        recording = part.recording
        motion = Motion.of(recording.pose, part.geometry, recording.origin)
        opening = _opening_of(recording)
        wrench = recording.wrench
        release = find_release(wrench.seconds(recording.origin), wrench.values, opening)
        if wrench.bursts:
            error = float(np.hypot(release.error, 1e-9 * wrench.bursts.error))
            release = replace(release, error=error)
        return cls(
            recording,
            part.geometry,
            part.number,
            part.count,
            opening=opening,
            motion=motion,
            release=release,
            grasp=find_grasp(opening, motion, release.time),
        )

    @property
    def force_time(self) -> np.ndarray:
        """Times of the force's samples [s], shape (S,)."""
        return self.recording.wrench.seconds(self.recording.origin)

    @property
    def force(self) -> np.ndarray:
        """In the wrench's frame [N], shape (S, 3)."""
        return self.recording.wrench.values

    def shifted(self, pose: float = 0.0, camera: float = 0.0) -> Pull:
        """Copy with stamps that are late by so many seconds put right.

        The pose's clock tells the motion and the grasp, which are found anew where it changes; the
        camera's tells neither. Raises UserError.
        """
        if not pose and not camera:
            return self
        moved = replace(self, recording=self.recording.shifted(pose, camera))
        if not pose:
            return moved
        motion = Motion.of(moved.recording.pose, self.geometry, self.recording.origin)
        grasp = find_grasp(self.opening, motion, self.release.time)
        return replace(moved, motion=motion, grasp=grasp)


def parts_of(recording: Recording, geometry: Geometry) -> list[Part]:
    """List a recording's pulls in time order; all of it where it is one or not understood.

    Raises:
        UserError: Several pulls are in it, but not where the hand is.
    """
    time = recording.wrench.seconds(recording.origin)
    releases = np.array(find_releases(time, recording.wrench.values, _opening_of(recording)))
    if len(releases) < 2 or np.diff(releases).min() < APART:
        return [Part(recording, geometry)]
    expect_dense(recording.pose)
    begins = [float(time[0]), *(releases[:-1] + SETTLE)]
    last = max(stream.seconds(recording.origin)[-1] for stream in recording.streams.values())
    ends = [
        _next_grasp(Part(recording.part(begin, release + SETTLE), geometry), release)
        for begin, release in zip(begins[1:], releases[1:], strict=True)
    ]
    ends = [*(end - MARGIN for end in ends), last]
    return [
        Part(recording.part(begin, end), geometry, number, len(begins))
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True), start=1)
    ]


def _opening_of(recording: Recording) -> Opening | None:
    gripper = recording.gripper
    return gripper and (gripper.seconds(recording.origin), gripper.values[:, 0])


def _next_grasp(between: Part, release: float) -> float:
    """Time [s] of the next grasp, of the band let go at `release`; half way where nothing tells.

    Args:
        between: From the pull before to this one.
    """
    recording = between.recording
    motion = Motion.of(recording.pose, between.geometry, recording.origin)
    try:
        return find_grasp(_opening_of(recording), motion, release)
    except UserError:
        return (recording.wrench.seconds(recording.origin)[0] + release) / 2


@dataclass(frozen=True)
class GraspLimits:
    """Thresholds of the fingers and of the hand, each with its unit and what it is for."""

    stroke: float = 0.002  # m, rad, ...: fingers that move less did not move
    jitters: float = 12.0  # robust deviations of the opening's noise: nor did those that move less
    held: float = 1.0  # s before the release: the median opening then is that of closed fingers
    late: float = 0.5  # s by which the gripper's topic may come late
    opened: float = 0.2  # of the range: fingers that moved by so much were or are open
    parts: float = 10.0  # of the stroke: within one of them from closed, fingers are still closed
    lift: float = 0.005  # m: a hand that is so much higher than at its lowest has lifted
    rest: float = 0.02  # m/s: a slower hand rests
    step: float = 0.02  # s over which that speed is taken


GRASP = GraspLimits()


def find_grasp(gripper: Opening | None, hand: Motion, release: float) -> float:
    """The first moment from which the fingers stay closed, or else that the hand lifts.

    The hand rests while it grasps: where it moves when the fingers are said to have closed, the
    gripper's topic is late, and the end of the rest just before counts.

    Args:
        gripper: None where it was not recorded.
        hand: z up.
        release: Time of the release [s].

    Raises:
        UserError: if the band was in the hand from the start, or never let go by the fingers.
    """
    if gripper is not None:
        if fingers_open(*gripper, release) is False:
            raise UserError(
                f"the force drops at {release:.3f} s but the gripper stays closed: the band slipped"
                " out or tore, or the sensor was zeroed; record again"
            )
        grasp = fingers_closed(*gripper, release)
        if grasp is not None:
            return _end_of_rest(hand, grasp)
    t, height = hand.time, hand.path[:, 2]
    before = t < release
    low = np.flatnonzero(before & (height < height[before].min(initial=np.inf) + GRASP.lift))
    lifted = before & (t > t[low[-1]]) if len(low) else np.zeros(0)
    if not lifted.any():
        raise UserError(
            "no grasp: the gripper does not close (or was not recorded) and the hand does not lift;"
            " record from before the grasp on"
        )
    return float(t[np.argmax(lifted)])


def fingers_open(t: np.ndarray, opening: np.ndarray, release: float) -> bool | None:
    """Whether the fingers open when the force drops; None where they were not seen to move."""
    after = (t > release) & (t < release + GRASP.late)
    held = (t < release) & (t > release - GRASP.held)
    if after.sum() < 3 or not held.any() or not _moved(opening):
        return None
    opening = _outward(t, opening, release) * opening
    return bool(opening[after].max() > np.median(opening[held]) + GRASP.opened * np.ptp(opening))


def fingers_closed(t: np.ndarray, opening: np.ndarray, release: float) -> float | None:
    """First time [s] after which the fingers stay closed until the release; None if not seen."""
    before, holding = _until(t, release)
    if not holding.any() or not _moved(opening):
        return None
    opening = _outward(t, opening, release) * opening
    closed = np.median(opening[holding])
    stroke = np.max(opening[before]) - closed
    if stroke < GRASP.stroke:
        return None
    wide = np.flatnonzero(opening[before] > closed + stroke / GRASP.parts)
    return float(t[wide[-1] + 1]) if wide[-1] + 1 < before.sum() else None


def _until(t: np.ndarray, release: float) -> tuple[np.ndarray, np.ndarray]:
    """Which times (S,) are before the release, and which of them in its last second."""
    before = t < release - MARGIN
    return before, before & (t > release - GRASP.held)


def _moved(opening: np.ndarray) -> bool:
    """Whether fingers moved, in whatever unit."""
    jitter = 1.4826 * float(np.median(np.abs(np.diff(opening)))) if len(opening) > 1 else 0.0
    return float(np.ptp(opening)) >= max(GRASP.stroke, GRASP.jitters * jitter)


def _outward(t: np.ndarray, opening: np.ndarray, release: float) -> float:
    """1, or -1 where the numbers grow when the fingers close, as a knuckle's angle does.

    Told by what they last were before they hold; by 1 where they were not seen to close.
    """
    before, holding = _until(t, release)
    if not holding.any():
        return 1.0
    away = opening[before] - np.median(opening[holding])
    wide = np.flatnonzero(np.abs(away) > GRASP.opened * np.ptp(opening))
    return -1.0 if len(wide) and away[wide[-1]] < 0 else 1.0


def _end_of_rest(hand: Motion, grasp: float) -> float:
    """`grasp`, or the end of the last rest before it if the hand moves then."""
    times = np.arange(grasp - GRASP.late, grasp + 1.5 * GRASP.step, GRASP.step)
    ways = np.diff(hand.position(times), axis=0)
    resting = np.linalg.norm(ways, axis=1) < GRASP.rest * GRASP.step
    inside = (times[:-1] >= hand.time[0]) & resting
    if inside[-2:].any() or not inside.any():
        return grasp
    return float(times[np.flatnonzero(inside)[-1] + 1])


NEAR, FAR = 0.005, 0.05  # s from a sample to the windows' near ends, and to their far ends


def reach(t: np.ndarray) -> tuple[int, int]:
    """NEAR and FAR in samples. Raises UserError for less than four times FAR of force."""
    period = float(np.median(np.diff(t)))
    near, far = max(1, round(NEAR / period)), max(3, round(FAR / period))
    if len(t) < 4 * far:
        raise UserError("the force is too short to find a release in it")
    return near, far


def means(x: np.ndarray, near: int, far: int) -> tuple[np.ndarray, np.ndarray]:
    """Means over [-far, -near] and over [near, far] samples around each sample, two (S, 3)."""
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(x, axis=0)])
    middle, last = np.arange(len(x)), len(x)

    def mean(first: int, end: int) -> np.ndarray:
        a, b = np.clip(middle + first, 0, last), np.clip(middle + end + 1, 0, last)
        return (sums[b] - sums[a]) / np.maximum(b - a, 1)[:, None]

    return mean(-far, -near), mean(near, far)


def sample_noise(x: np.ndarray) -> float:
    """Standard deviation of single samples (S, ...) about what changes slowly: the largest.

    By the median absolute deviation (MAD) of first differences, which a few steps do not move.
    """
    change = np.diff(x, axis=0)
    spread = np.median(np.abs(change - np.median(change, axis=0)), axis=0)
    return float(np.max(1.4826 * spread / np.sqrt(2)))


@dataclass(frozen=True)
class ReleaseLimits:
    """Thresholds of the force; the drop is from the held force to that of the free hand."""

    pull: float = 0.5  # N: what drops by less was not drawn
    sudden: float = 0.5  # of a lasting change that comes at once where a band is let go
    slip: float = 0.2  # of the largest drop, from which another sudden one is worth a word
    free: float = 0.3  # of the held force that a free hand may still feel
    noise: float = 6.0  # standard deviations: a sample that is off by more is no longer held,
    held: float = 0.02  # of the drop: if it is off by more than this as well
    least_noise: float = 0.003  # of the drop: no fall is so straight that samples tell more
    gap: float = 3.5  # periods around the release in which force must not be missing
    before: tuple[float, int] = (0.006, 6)  # s, samples: so early may begin what noise hides
    slowest: float = 0.03  # s: no band is let go more slowly
    looked: float = 0.5  # of the drop: what comes later does not tell the fall's beginning,
    rings: float = 0.15  # of the drop: for the sensor may ring by this
    timed: tuple[float, float] = (0.9, 0.3)  # of the held force, between which a fall is timed
    periods: float = 3.0  # that it takes at least where a filter made it,
    alike: float = 0.4  # correlation of neighbouring samples' noise: and that the filter leaves


RELEASE = ReleaseLimits()


@dataclass(frozen=True)
class Release:
    """The end of the pull.

    Attributes:
        time: The force begins to drop [s].
        error: Standard deviation of `time` [s], by the samples' spacing and noise, and by the delay
            of a filter.
        fall: In which the force falls to nothing [s]; where that is over between two samples, some
            of their distance.
        resolution: Time between force samples around it [s].
        hold: Mean force while held, sensor frame, bias included [N], shape (3,).
        noise: Standard deviation of one force sample along the pull [N].
        drop: How much the force fell [N].
        slips: Sudden drops of the force before the release [s].
        spread: Time from 9 to 3 tenths of the held force [s].
        filtered: It is more than rubber needs: a filter is between sensor and recording.
    """

    time: float
    error: float
    fall: float
    resolution: float
    hold: np.ndarray
    noise: float
    drop: float
    slips: list[float] = field(default_factory=list)
    spread: float = 0.0
    filtered: bool = False


def find_releases(t: np.ndarray, force: np.ndarray, gripper: Opening | None) -> list[float]:
    """About when the pulls of a recording end [s]; none where nothing tells.

    With a gripper they end where the fingers open, and where a band slips out that was grasped for
    this pull, if it is grasped anew for the next one. Arguments are those of `find_release`.
    """
    releases: list[float] = []
    try:
        drops = _Drops.of(t, force, gripper)
    except UserError:
        return []
    for i, later in pairwise([*drops.free, None]):
        if gripper is not None and i not in drops.ends:
            moments = (float(t[k]) for k in (i, i if later is None else later))
            grasp, again = (fingers_closed(*gripper, moment) for moment in moments)
            if grasp is None or (releases and grasp < releases[-1]):
                continue
            if later is not None and (again is None or again < t[i]):
                continue
        releases.append(float(t[i]))
    return releases


def find_release(t: np.ndarray, force: np.ndarray, gripper: Opening | None = None) -> Release:
    """Find the release in a raw force, whose bias need not be known.

    Sudden drops that last are found first, by differences of short and of long means before and
    after: a knock does not last. The release is the one that leaves the hand free, or else the
    largest, and with a gripper one at which the fingers open. Around it, the moment at which the
    fall begins is the mean over all straight falls, weighed by how well they go with the samples.

    Args:
        t: Times [s], shape (S,).
        force: Any constant frame [N], shape (S, 3).
        gripper: None where it was not recorded.

    Raises:
        UserError: if the force never drops as it does when a drawn band is let go, or does so
            more than once.
    """
    period = float(np.median(np.diff(t)))
    drops, (_, far) = _Drops.of(t, force, gripper), reach(t)
    center = drops.release(t)

    # The force along the drop: while held, and once the hand is free.
    quiet = slice(max(0, center - 6 * far), center - far)
    settled = slice(min(center + far, len(t) - 1), min(center + 6 * far, len(t)))
    hold, free = force[quiet].mean(axis=0), force[settled].mean(axis=0)
    drop = float(np.linalg.norm(hold - free))
    along = force @ ((hold - free) / drop)
    level, noise = along[quiet].mean(), sample_noise(along[quiet])
    threshold = max(RELEASE.noise * noise, RELEASE.held * drop)

    # Half of the fall, and the first sample that is not held any more.
    window = slice(quiet.stop - far, settled.stop)
    half = window.start + int(np.argmax(along[window] < level - drop / 2))
    first = _behind_last(along[:half] > level - threshold, half)
    resolution = float(t[first] - t[first - 1])
    if resolution > RELEASE.gap * period:
        raise UserError(
            f"force is missing for {1e3 * resolution:.0f} ms around the release at"
            f" {t[first]:.3f} s: its time cannot be determined, record again"
        )
    fall = (level - along) / drop
    time, error, lasted = _onset(t, fall, first, max(noise / drop, RELEASE.least_noise), period)
    slips = [float(t[i]) for i in drops.at if i < center]
    spread = _fall_time(t, along, half, *(level - drop * (1 - share) for share in RELEASE.timed))
    filtered = spread > RELEASE.periods * period and (
        spread > OPENING or _alike(along[quiet]) > RELEASE.alike
    )
    if filtered:  # it may have been applied forwards, or both ways
        error = float(np.hypot(error, spread / 2))
    return Release(time, error, lasted, resolution, hold, noise, drop, slips, spread, filtered)


def _behind_last(which: np.ndarray, otherwise: int) -> int:
    """Number of the sample behind the last one that is marked (S,)."""
    marked = np.flatnonzero(which)
    return int(marked[-1]) + 1 if len(marked) else otherwise


def _fall_time(t: np.ndarray, x: np.ndarray, half: int, high: float, low: float) -> float:
    """Time [s] from when x (S,) is last above a value to when it is first below another.

    Args:
        half: A sample between the two.
    """
    below = x[half:] < low
    last = half + int(np.argmax(below)) if below.any() else len(x) - 1
    return _crossing(t, x, low, last) - _crossing(t, x, high, _behind_last(x[:half] > high, half))


def _crossing(t: np.ndarray, x: np.ndarray, value: float, k: int) -> float:
    """Time [s] at which x (S,) falls below a value between samples k - 1 and k; linear between."""
    return float(np.interp(-value, [-x[k - 1], -min(x[k], x[k - 1])], [t[k - 1], t[k]]))


def _alike(x: np.ndarray) -> float:
    """Correlation of neighbouring samples (S,) of noise about a straight line."""
    at = np.arange(len(x))
    left = x - np.polyval(np.polyfit(at, x, 1), at)
    return float(left[1:] @ left[:-1] / max(left @ left, 1e-30))


class _Drops(NamedTuple):
    """Sudden drops of the force that last.

    Attributes:
        at: Their samples, shape (K,).
        size: Of a drop at each sample of the force [N], shape (S,).
        free: Samples of those that leave the hand free.
        ends: Of these, those at which the fingers open; all of them where they open at none.
    """

    at: np.ndarray
    size: np.ndarray
    free: list[int]
    ends: list[int]

    @classmethod
    def of(cls, t: np.ndarray, force: np.ndarray, gripper: Opening | None) -> _Drops:
        """Find them by the difference of short and of long means. Raises UserError."""
        near, far = reach(t)
        sudden = np.linalg.norm(np.subtract(*means(force, near, far)), axis=1)
        before, after = means(force, far, 6 * far)
        lasting = np.linalg.norm(before - after, axis=1)
        size = np.where(sudden >= RELEASE.sudden * lasting, np.minimum(sudden, lasting), 0)
        size[: far + 1] = size[-far:] = 0
        largest = size.max()
        least = max(RELEASE.pull, RELEASE.slip * largest)
        at, _ = find_peaks(size, height=least, distance=far)
        at = np.array([i for i in at if _median_step(force, i, far) > least], int)
        if not len(at):
            raise UserError(_no_drop(t, force, lasting[far:-far], far))
        rest = force[t < t[0] + LEAST_LEAD_IN].mean(axis=0)
        held, left = (np.linalg.norm(x[at] - rest, axis=1) for x in (before, after))
        freed = left < RELEASE.free * held
        opened = [i for i in at[freed] if gripper and fingers_open(*gripper, float(t[i]))]
        large = at[freed & (size[at] >= RELEASE.sudden * largest)]
        free = sorted({*large.tolist(), *map(int, opened)})
        return cls(at, size, free, opened or free)

    def release(self, t: np.ndarray) -> int:
        """The sample at which the band is let go. Raises UserError where several could be it."""
        if len(self.ends) > 1:
            times = " and ".join(f"{t[i]:.1f}" for i in self.ends)
            raise UserError(f"a band is let go at {times} s: nothing tells the pulls apart")
        return int(self.ends[0] if self.ends else self.at[np.argmax(self.size[self.at])])


def _no_drop(t: np.ndarray, force: np.ndarray, lasting: np.ndarray, far: int) -> str:
    """Why no sudden drop is found: too slow, or not there."""
    slow, whole = float(lasting.max(initial=0)), float(np.linalg.norm(np.ptp(force, axis=0)))
    if slow > max(RELEASE.pull, RELEASE.sudden * whole):
        at = t[far + int(np.argmax(lasting))]
        return (
            f"the force falls by {slow:.1f} N at {at:.1f} s, but not at once as rubber does: it is"
            " filtered; record the sensor's own, unfiltered force"
        )
    return (
        f"the force never drops by {RELEASE.pull} N at once: no release of a drawn band is in it,"
        " or it is not in newtons"
    )


def _median_step(force: np.ndarray, i: int, far: int) -> float:
    """Size of a step as the difference of long medians: blind to a knock, which means are not."""
    before, after = force[max(0, i - 6 * far) : i - far], force[i + far : i + 6 * far]
    return float(np.linalg.norm(np.median(before, axis=0) - np.median(after, axis=0)))


def _onset(
    t: np.ndarray, fall: np.ndarray, first: int, noise: float, period: float
) -> tuple[float, float, float]:
    """Mean and standard deviation of when the fall (0 held, 1 gone) began, and how long it lasted.

    The posterior of a change point, on a grid: over all straight falls that begin at r and last D,
    of any D alike on a logarithmic scale, with Gaussian noise. What comes after half of the fall is
    not looked at: a sensor may ring there. A fall that is over between two samples is thus found
    between them, not at the second one.
    """
    looked, (before, samples), last = RELEASE.looked, RELEASE.before, first
    while last + 1 < len(t) and fall[last] < looked:
        last += 1
    earliest = max(0, first - max(samples, round(before / period)))
    begin = np.arange(t[earliest], t[last], period / 100)[:, None]
    lasts = np.geomspace(period / 20, RELEASE.slowest, 150)
    misfit = np.zeros((len(begin), len(lasts)))
    for time, seen in zip(t[earliest : last + 1], fall[earliest : last + 1], strict=True):
        expected = np.minimum((time - begin).clip(0) / lasts, looked)
        spread = noise if seen < looked else max(noise, RELEASE.rings)
        misfit += ((expected - min(seen, looked)) / spread) ** 2
    both = np.exp((misfit.min() - misfit) / 2)
    both /= both.sum()
    weight, lasted = both.sum(axis=1), both.sum(axis=0) @ lasts
    mean = weight @ begin[:, 0]
    return float(mean), float(np.sqrt(weight @ (begin[:, 0] - mean) ** 2)), float(lasted)
