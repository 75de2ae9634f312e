"""Blocks of the pull that a fit leaves out, and how far the filters reach beyond them."""

from __future__ import annotations

import numpy as np

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode

SETTLED = 1e-3  # what is left of a pulse in the low-pass when its reach ends


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
