"""Parts of an episode: slack, taut, recoil, swing; and blocks of the pull that a fit leaves out."""

from __future__ import annotations

import numpy as np

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode

MIDDLE = 0.03  # the middle of the band: points this near the plane x = 0 [m]
LONGEST_RECOIL = 0.2  # after the release [s]; soft bands cross the fork plane within 0.1
TAUT = 0.05  # of the peak force, above the band's weight: below it the band is slack
SETTLED = 1e-3  # what is left of a pulse in the low-pass when its reach ends


def phases(episode: Episode) -> dict[str, tuple[float, float]]:
    """Begin and end [s] of slack, taut (until the release), recoil, swing; each ends as one begins.

    The recoil ends with the first frame that shows the middle past the fork plane. Raises UserError
    where the hand's force never rises.
    """
    recoil = np.flatnonzero(taut_frames(episode))
    after = episode.cloud_time > episode.release_time
    after[recoil] = False
    latest = episode.release_time + LONGEST_RECOIL
    bounds = [
        float(episode.time[0] - episode.sample_period / 2),
        taut_time(episode),
        episode.release_time,
        float(min([latest, *episode.cloud_time[after]])),
        float(max(episode.time[-1] + episode.sample_period / 2, episode.cloud_time[-1])),
    ]
    names = ("slack", "taut", "recoil", "swing")
    return dict(zip(names, zip(bounds[:-1], bounds[1:], strict=True), strict=True))


def taut_time(episode: Episode) -> float:
    """When the hand's force begins to rise [s]. Raises UserError where it never does."""
    size = np.linalg.norm(episode.force, axis=1)
    held = (episode.time > episode.grasp_time) & (episode.time < episode.release_time)
    peak, weight = size[held].max(), np.median(size[held][:30])
    taut = held & (size > TAUT * peak + min(1.5 * weight, 0.2 * peak))
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


def reach(period: float, cutoff: float, median_window: int) -> float:
    """How far a recorded moment reaches into the samples around it [s].

    Through the zero-phase Butterworth, until SETTLED is left (its poles decay at cutoff · 2π/√2),
    the mean over a sample, and the median filter.
    """
    lowpass = np.log(1 / SETTLED) / (np.sqrt(2) * np.pi * cutoff)
    return float(lowpass + (median_window // 2 + 1) * period)


def held_out_blocks(episode: Episode, blocks: int, length: float, guard: float) -> np.ndarray:
    """Begin and end [s] of blocks that a fit leaves out, shape (blocks, 2).

    Each lies in the middle of an equal share of the time from grasp to release. The recoil is never
    among them: its few frames are all that shows the damping, so a fit without them is another
    question, not a check of this one.

    Args:
        length: Of each block [s].
        guard: Left out on each side of a block as well [s].

    Raises:
        UserError: Less than half of the pull would be left for the fit.
    """
    begin, end = episode.grasp_time, episode.release_time
    lost = blocks * (length + 2 * guard)
    if lost > (end - begin) / 2:
        raise UserError(
            f"loss.held_out: {blocks} blocks of {length:g} s with guards of {guard:.2f} s leave out"
            f" {lost:.1f} s of the {end - begin:.1f} s from grasp to release of {episode.band};"
            " at most half may be left out, take fewer or shorter ones"
        )
    middle = begin + (np.arange(blocks) + 0.5) * (end - begin) / max(blocks, 1)
    return np.stack([middle - length / 2, middle + length / 2], axis=1)


def within(times: np.ndarray, intervals: np.ndarray, margin: float = 0.0) -> np.ndarray:
    """Which times (T,) lie in one of the intervals (B, 2) widened by a margin, shape (T,)."""
    low, high = intervals.T
    return ((times[:, None] > low - margin) & (times[:, None] < high + margin)).any(axis=1)
