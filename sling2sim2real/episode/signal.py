"""The filter and the averaging that measured and simulated forces pass alike."""

from __future__ import annotations

import math

import numpy as np

NOMINAL_RATE = 1000.0  # Hz: "rad/sample" counts samples of a 1 kHz sensor
SIMULATED_RATE = 1000.0  # of simulated forces on their way through the filter [Hz]
ORDER = 2
PULSES = 32  # that are filtered at once
FORGOTTEN = 140.0  # time constants of the low-pass after which no rounding shows what was before
SETTLING = 0.2  # s of odd extension at each end, many time constants of any useful cutoff


def cutoff_hz(cutoff: float, unit: str) -> float:
    """The cutoff of `params.force` in Hz: 0.224 rad/sample at 1 kHz is 35.7 Hz at any rate."""
    scale = {"Hz": 1.0, "rad/s": 1 / math.tau, "rad/sample": NOMINAL_RATE / math.tau}
    return cutoff * scale[unit]


def uniform(t: np.ndarray, x: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate x (S, ...) at increasing times t (S,) to a grid of `rate` Hz that begins at t[0].

    Returns:
        The grid, shape (M,), and the values, shape (M, ...).
    """
    grid = t[0] + np.arange(int((t[-1] - t[0]) * rate + 1e-6) + 1) / rate
    return grid, _at(grid, t, x)


def lowpass(x: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    """Zero-phase second-order Butterworth along the first axis; unchanged if beyond Nyquist.

    Forwards and backwards: the gain at the cutoff is one half, and nothing is delayed.

    Args:
        x: Uniform samples, shape (S, ...).
        rate: Samples a second.
        cutoff: Of one pass, in Hz.
    """
    from scipy.signal import butter, sosfiltfilt  # which takes half a second

    if cutoff >= rate / 2:
        return np.array(x, float)
    sections = butter(ORDER, cutoff, fs=rate, output="sos")
    padding = min(int(max(SETTLING, 2 / cutoff) * rate), len(x) - 1)
    return sosfiltfilt(sections, x, axis=0, padlen=padding)


def average(t: np.ndarray, x: np.ndarray, t0: float, period: float, samples: int) -> np.ndarray:
    """Mean of x over each of `samples` intervals of length `period` from t0 on.

    x is taken as piecewise linear between its (irregular) times and constant beyond them, so that
    1 kHz recordings and simulated steps of any length are averaged alike.

    Args:
        t: Increasing times, shape (S,).
        x: Values, shape (S, ...).

    Returns:
        Shape (samples, ...).
    """
    return _means(t, x, t0 + period * np.arange(samples + 1), period)


def _means(t: np.ndarray, x: np.ndarray, edges: np.ndarray, period: float) -> np.ndarray:
    """Mean of x between edges (N + 1,) that are `period` apart, as `average` has it, (N, ...)."""
    inside = t[(t > edges[0]) & (t < edges[-1])]
    knots = np.union1d(edges, inside)
    values = _at(knots, t, x)
    steps = np.diff(knots).reshape(-1, *(1,) * (values.ndim - 1))
    areas = np.concatenate([np.zeros_like(values[:1]), steps * (values[1:] + values[:-1]) / 2])
    integral = np.cumsum(areas, axis=0)
    return np.diff(integral[np.searchsorted(knots, edges)], axis=0) / period


def as_recorded(
    t: np.ndarray, x: np.ndarray, cutoff: float, t0: float, period: float, samples: int
) -> np.ndarray:
    """Simulated values on the recorded force's way: low-pass, then means over its samples.

    Args:
        t: Increasing times of the simulation's steps, shape (S,).
        x: Values, shape (S, ...).
        cutoff: As for `lowpass`.
        t0, period, samples: As for `average`.

    Returns:
        Shape (samples, ...).
    """
    grid, x = uniform(t, x, SIMULATED_RATE)
    return average(grid, lowpass(x, SIMULATED_RATE, cutoff), t0, period, samples)


def recording_matrix(
    t: np.ndarray, cutoff: float, t0: float, period: float, samples: int
) -> np.ndarray:
    """`as_recorded`, which is linear, as a matrix: shape (samples, S), for arguments as there.

    Each column is what a pulse at one time becomes, and is looked for where the filter remembers it
    alone.
    """
    grid = t[0] + np.arange(int((t[-1] - t[0]) * SIMULATED_RATE + 1e-6) + 1) / SIMULATED_RATE
    edges = t0 + period * np.arange(samples + 1)
    reach = FORGOTTEN * math.sqrt(2) / (math.tau * cutoff) + SETTLING
    matrix = np.zeros((samples, len(t)))
    for first in range(0, len(t), PULSES):
        last = min(first + PULSES, len(t))
        begin = t[first - 1] - reach if first else -np.inf
        end = t[last] + reach if last < len(t) else np.inf
        g = slice(*np.searchsorted(grid, (begin, end)))
        row = slice(*np.searchsorted(edges, (begin, end)) + (-1, 1))
        # what is at an end of the grid goes on beyond it
        row = slice(
            row.start if g.start else 0, min(row.stop, samples) if g.stop < len(grid) else samples
        )
        pulses = _at(grid[g], t, np.eye(len(t), last - first, -first))
        filtered = lowpass(pulses, SIMULATED_RATE, cutoff)
        matrix[row, first:last] = _means(grid[g], filtered, edges[row.start : row.stop + 1], period)
    return matrix


def _at(times: np.ndarray, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Linear interpolation along the first axis, constant beyond the ends."""
    x = np.asarray(x, float)
    last = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
    part = np.clip((times - t[last - 1]) / (t[last] - t[last - 1]), 0, 1)
    part = part.reshape(-1, *(1,) * (x.ndim - 1))
    return x[last - 1] * (1 - part) + x[last] * part
