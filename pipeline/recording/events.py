"""Find when the hand grasps the band and lets it go, from gripper, force and motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.signal import find_peaks

from pipeline.base.errors import UserError

Opening = tuple[np.ndarray, np.ndarray]  # of the gripper: times [s] and opening, both (G,)

MARGIN = 0.05  # s kept clear of the grasp and of the release when means are taken
SETTLE = 0.4  # s after the release until the hand is free and at rest
SIGMAS = 6.0
LEAST_PULL = 0.5  # N: below it nothing was drawn
GAP = 3.5  # periods of the force around the release
SUDDEN = 0.5  # share of the drop that a release takes within a few hundredths of a second
SLIP = 0.2  # share of the largest drop from which a sudden drop is worth a word
FREE = 0.3  # share of the held force that a free hand may still feel
LEAST_STROKE = 0.002  # m, rad, ...: fingers that move less than this did not move
OPENS = 0.5  # s by which the gripper's topic may come late
LEAD_IN = 0.2  # s at least
LIFT = 0.005  # m
AT_REST = 0.02  # m/s
SLOWEST_FALL = 0.03  # s
FALLING = (0.9, 0.3)  # shares of the drop between which the fall is timed: what rings is below
RUBBER = 0.006  # s: pads open in less, and rubber follows them at once
ALIKE = 0.4  # correlation of neighbouring samples' noise, from which a filter may have made it
RINGS = 0.15  # share of the drop: past half of the fall the sensor may ring by this


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
        slips: Other sudden drops of the force [s].
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
        _, free, ends, _ = _drops(t, force, *reach(t), gripper)
    except UserError:
        return []
    for i, later in pairwise([*free, None]):
        if gripper is not None and i not in ends:
            moments = (float(t[k]) for k in (i, i if later is None else later))
            grasp, again = (_closed(*gripper, moment) for moment in moments)
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
    near, far = reach(t)
    center, others = _steepest(t, force, near, far, gripper)

    quiet = slice(max(0, center - 6 * far), center - far)
    settled = slice(min(center + far, len(t) - 1), min(center + 6 * far, len(t)))
    hold, free = force[quiet].mean(axis=0), force[settled].mean(axis=0)
    drop = float(np.linalg.norm(hold - free))
    along = force @ ((hold - free) / drop)
    level, noise = along[quiet].mean(), sample_noise(along[quiet])
    threshold = max(SIGMAS * noise, 0.02 * drop)

    window = slice(quiet.stop - far, settled.stop)
    half = window.start + int(np.argmax(along[window] < level - drop / 2))
    held = np.flatnonzero(along[:half] > level - threshold)
    first = int(held[-1]) + 1 if len(held) else half
    resolution = float(t[first] - t[first - 1])
    if resolution > GAP * period:
        raise UserError(
            f"force is missing for {1e3 * resolution:.0f} ms around the release at"
            f" {t[first]:.3f} s: its time cannot be determined, record again"
        )
    fall = (level - along) / drop
    time, error, lasted = _onset(t, fall, first, max(noise / drop, 0.003), period)
    slips = [float(t[i]) for i in others]
    high, low = (level - drop * (1 - share) for share in FALLING)
    spread = _first_below(t, along, low, half) - _last_above(t, along, high, half)
    filtered = spread > 3 * period and (spread > RUBBER or _alike(along[quiet]) > ALIKE)
    if filtered:  # it may have been applied forwards, or both ways
        error = float(np.hypot(error, spread / 2))
    return Release(time, error, lasted, resolution, hold, noise, drop, slips, spread, filtered)


def _first_below(t: np.ndarray, x: np.ndarray, value: float, near: int) -> float:
    """Time [s] when x (S,) first falls below a value, from sample `near` - 1 on; linear between."""
    below = x[near:] < value
    k = near + int(np.argmax(below)) if below.any() else len(x) - 1
    return float(np.interp(-value, [-x[k - 1], -min(x[k], x[k - 1])], [t[k - 1], t[k]]))


def _last_above(t: np.ndarray, x: np.ndarray, value: float, near: int) -> float:
    """Time [s] at which x (S,) is last above a value, up to sample `near`; linear between."""
    above = np.flatnonzero(x[:near] > value)
    k = int(above[-1]) + 1 if len(above) else near
    return float(np.interp(-value, [-x[k - 1], -min(x[k], x[k - 1])], [t[k - 1], t[k]]))


def _alike(x: np.ndarray) -> float:
    """Correlation of neighbouring samples (S,) of noise about a straight line."""
    at = np.arange(len(x))
    left = x - np.polyval(np.polyfit(at, x, 1), at)
    return float(left[1:] @ left[:-1] / max(left @ left, 1e-30))


def reach(t: np.ndarray) -> tuple[int, int]:
    """Samples to either side over which short and long means are taken. Raises UserError."""
    period = float(np.median(np.diff(t)))
    near, far = max(1, round(0.005 / period)), max(3, round(0.05 / period))
    if len(t) < 4 * far:
        raise UserError("the force is too short to find a release in it")
    return near, far


def sample_noise(x: np.ndarray) -> float:
    """Standard deviation of single samples (S, ...) about what changes slowly: the largest."""
    change = np.diff(x, axis=0)
    spread = np.median(np.abs(change - np.median(change, axis=0)), axis=0)
    return float(np.max(1.4826 * spread / np.sqrt(2)))


def _steepest(
    t: np.ndarray, force: np.ndarray, near: int, far: int, gripper: Opening | None
) -> tuple[int, list[int]]:
    """Sample at which the band is let go, and those of sudden drops before it."""
    drops, _, ends, size = _drops(t, force, near, far, gripper)
    if len(ends) > 1:
        times = " and ".join(f"{t[i]:.1f}" for i in ends)
        raise UserError(f"a band is let go at {times} s: nothing tells the pulls apart")
    release = int(ends[0] if ends else drops[np.argmax(size[drops])])
    return release, [int(i) for i in drops if i < release]


def _drops(
    t: np.ndarray, force: np.ndarray, near: int, far: int, gripper: Opening | None
) -> tuple[np.ndarray, list[int], list[int], np.ndarray]:
    """Samples of sudden drops; which leave the hand free; which the fingers let go (all of these
    where none does); the drop at each sample of the force.
    """
    sudden = np.linalg.norm(np.subtract(*means(force, near, far)), axis=1)
    before, after = means(force, far, 6 * far)
    lasting = np.linalg.norm(before - after, axis=1)
    size = np.where(sudden >= SUDDEN * lasting, np.minimum(sudden, lasting), 0)
    size[: far + 1] = size[-far:] = 0
    largest = size.max()
    least = max(LEAST_PULL, SLIP * largest)
    drops, _ = find_peaks(size, height=least, distance=far)
    drops = np.array([i for i in drops if _median_step(force, i, far) > least], int)
    if not len(drops):
        raise UserError(_no_drop(t, force, lasting[far:-far], size, far))
    rest = force[t < t[0] + LEAD_IN].mean(axis=0)
    held, left = (np.linalg.norm(x[drops] - rest, axis=1) for x in (before, after))
    opened = [i for i in drops[left < FREE * held] if gripper and _opens(*gripper, float(t[i]))]
    large = drops[(left < FREE * held) & (size[drops] >= SUDDEN * largest)]
    free = sorted({*large.tolist(), *map(int, opened)})
    return drops, free, opened or free, size


def _no_drop(
    t: np.ndarray, force: np.ndarray, lasting: np.ndarray, size: np.ndarray, far: int
) -> str:
    """Why no sudden drop is found: too slow, in other units, or not there."""
    slow, noise = float(lasting.max(initial=0)), sample_noise(force)
    whole = float(np.linalg.norm(np.ptp(force, axis=0)))
    if slow > max(LEAST_PULL, SUDDEN * whole):
        at = t[far + int(np.argmax(lasting))]
        return (
            f"the force falls by {slow:.1f} N at {at:.1f} s, but not at once as rubber does: it is"
            " filtered; record the sensor's own, unfiltered force"
        )
    if 0 < 30 * noise / np.sqrt(far) < size.max() < LEAST_PULL / 5:
        return (
            f"the force drops suddenly, but by {size.max():.2g} N only: a drawn band pulls with"
            " newtons; is it in kilonewtons? Let the driver publish newtons"
        )
    return f"the force never drops by {LEAST_PULL} N at once: no release of a drawn band is in it"


def means(x: np.ndarray, near: int, far: int) -> tuple[np.ndarray, np.ndarray]:
    """Means over [-far, -near] and over [near, far] samples around each sample, two (S, 3)."""
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(x, axis=0)])
    middle, last = np.arange(len(x)), len(x)

    def mean(first: int, end: int) -> np.ndarray:
        a, b = np.clip(middle + first, 0, last), np.clip(middle + end + 1, 0, last)
        return (sums[b] - sums[a]) / np.maximum(b - a, 1)[:, None]

    return mean(-far, -near), mean(near, far)


def _median_step(force: np.ndarray, i: int, far: int) -> float:
    """Size of a step as the difference of long medians: blind to a knock, which means are not."""
    before, after = force[max(0, i - 6 * far) : i - far], force[i + far : i + 6 * far]
    return float(np.linalg.norm(np.median(before, axis=0) - np.median(after, axis=0)))


def _onset(
    t: np.ndarray, fall: np.ndarray, first: int, noise: float, period: float
) -> tuple[float, float, float]:
    """Mean and standard deviation of when the fall (0 held, 1 gone) began, and how long it lasted.

    Over all straight falls that begin at r and last D, of any D alike on a logarithmic scale, with
    Gaussian noise. What comes after half of the fall is not looked at: a sensor may ring there. A
    fall that is over between two samples is thus found between them, not at the second one.
    """
    last = first
    while last + 1 < len(t) and fall[last] < 0.5:
        last += 1
    earliest = max(0, first - max(6, round(0.006 / period)))
    begin = np.arange(t[earliest], t[last], period / 100)[:, None]
    lasts = np.geomspace(period / 20, SLOWEST_FALL, 150)
    misfit = np.zeros((len(begin), len(lasts)))
    for time, seen in zip(t[earliest : last + 1], fall[earliest : last + 1], strict=True):
        expected = np.minimum((time - begin).clip(0) / lasts, 0.5)
        spread = noise if seen < 0.5 else max(noise, RINGS)
        misfit += ((expected - min(seen, 0.5)) / spread) ** 2
    both = np.exp((misfit.min() - misfit) / 2)
    both /= both.sum()
    weight, lasted = both.sum(axis=1), both.sum(axis=0) @ lasts
    mean = weight @ begin[:, 0]
    return float(mean), float(np.sqrt(weight @ (begin[:, 0] - mean) ** 2)), float(lasted)


def find_grasp(
    gripper: Opening | None,
    pose: tuple[np.ndarray, np.ndarray],
    release: float,
) -> float:
    """The first moment from which the fingers stay closed, or else that the hand lifts.

    The hand rests while it grasps: where it moves when the fingers are said to have closed, the
    gripper's topic is late, and the end of the rest just before counts.

    Args:
        gripper: None where it was not recorded.
        pose: Times (S,) [s] and path (S, 3) [m] of the hand, z up.
        release: Time of the release [s].

    Raises:
        UserError: if the band was in the hand from the start, or never let go by the fingers.
    """
    if gripper is not None:
        if _opens(*gripper, release) is False:
            raise UserError(
                f"the force drops at {release:.3f} s but the gripper stays closed: the band slipped"
                " out or tore, record again with a firmer grip"
            )
        grasp = _closed(*gripper, release)
        if grasp is not None:
            return _rested(*pose, grasp)
    t, height = pose[0], pose[1][:, 2]
    before = t < release
    low = np.flatnonzero(before & (height < height[before].min(initial=np.inf) + LIFT))
    lifted = before & (t > t[low[-1]]) if len(low) else np.zeros(0)
    if not lifted.any():
        raise UserError(
            "no grasp: the gripper does not close (or was not recorded) and the hand does not lift;"
            " record from before the grasp on"
        )
    return float(t[np.argmax(lifted)])


def _opens(t: np.ndarray, opening: np.ndarray, release: float) -> bool | None:
    """Whether the fingers open when the force drops; None where they were not seen to move."""
    after = (t > release) & (t < release + OPENS)
    held = (t < release) & (t > release - 1.0)
    if after.sum() < 3 or not held.any() or not _moved(opening):
        return None
    opening = _outward(t, opening, release) * opening
    return bool(opening[after].max() > np.median(opening[held]) + 0.2 * np.ptp(opening))


def _closed(t: np.ndarray, opening: np.ndarray, release: float) -> float | None:
    """First sample after which the fingers stay within a tenth of their stroke from closed."""
    before = t < release - 0.05
    holding = before & (t > release - 1.0)
    if not holding.any() or not _moved(opening):
        return None
    opening = _outward(t, opening, release) * opening
    closed = np.median(opening[holding])
    stroke = np.max(opening[before]) - closed
    if stroke < LEAST_STROKE:
        return None
    wide = np.flatnonzero(opening[before] > closed + stroke / 10)
    return float(t[wide[-1] + 1]) if wide[-1] + 1 < before.sum() else None


def _moved(opening: np.ndarray) -> bool:
    """Whether fingers moved, in whatever unit."""
    jitter = 1.4826 * float(np.median(np.abs(np.diff(opening)))) if len(opening) > 1 else 0.0
    return float(np.ptp(opening)) >= max(LEAST_STROKE, 2 * SIGMAS * jitter)


def _outward(t: np.ndarray, opening: np.ndarray, release: float) -> float:
    """1, or -1 where the numbers grow when the fingers close, as a knuckle's angle does.

    Told by what they last were before they hold; by 1 where they were not seen to close.
    """
    before = t < release - 0.05
    holding = before & (t > release - 1.0)
    if not holding.any():
        return 1.0
    away = opening[before] - np.median(opening[holding])
    wide = np.flatnonzero(np.abs(away) > 0.2 * np.ptp(opening))
    return -1.0 if len(wide) and away[wide[-1]] < 0 else 1.0


def _rested(t: np.ndarray, path: np.ndarray, grasp: float) -> float:
    """`grasp`, or the end of the last rest before it if the hand moves then."""
    times = np.arange(grasp - OPENS, grasp + 0.03, 0.02)
    at = np.stack([np.interp(times, t, axis) for axis in path.T], axis=1)
    resting = np.linalg.norm(np.diff(at, axis=0), axis=1) < AT_REST * 0.02
    inside = (times[:-1] >= t[0]) & resting
    if inside[-2:].any() or not inside.any():
        return grasp
    return float(times[np.flatnonzero(inside)[-1] + 1])
