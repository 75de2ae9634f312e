"""Nuisances: what instruments and air add, identified beside theta where a method asks for it.

Each is one value a rollout and acts on the simulated side, as the instrument would; the recording
stays as it is. At 1 for the gain and 0 for the others nothing is changed. The air's drag is the one
that launches feel as well.

    air_drag       force on the moving band for its mass and speed                       [1/s]
    camera_delay   a picture stamped t shows the band as it was at t - delay             [s]
    force_delay    a force stamped t is that of t - delay, before the filter             [s]
    force_gain     the sensor shows so many times the force
    force_bias_*   and adds this, along x, y, z                                          [N]
    cloud_shift_*  clouds lie so far from where the band is, along x, y, z (extrinsics)  [m]
"""

from __future__ import annotations

import numpy as np

AIR_DRAG = "air_drag"  # of the simulator; the others are the instruments'
NUISANCES = (  # in the order of their axes
    AIR_DRAG,
    "camera_delay",
    "force_delay",
    "force_gain",
    *(f"force_bias_{axis}" for axis in "xyz"),
    *(f"cloud_shift_{axis}" for axis in "xyz"),
)
SPACING = 1e-3  # of the delays at which a simulation is read; between them it is interpolated [s]


class Delay:
    """Delays within bounds: the values that are simulated, and how others lie between them."""

    def __init__(self, bounds: tuple[float, float] | None) -> None:
        """Without bounds, none: the one value is 0."""
        low, high = bounds or (0.0, 0.0)
        self.values = np.linspace(low, high, int(np.ceil((high - low) / SPACING - 1e-9)) + 1)

    def between(self, delay: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of delays (N,): the value below, its number (N,), and the share of the next one (N,)."""
        place = np.clip(delay, self.values[0], self.values[-1]) - self.values[0]
        place = place / (self.values[1] - self.values[0])
        below = np.minimum(place.astype(int), len(self.values) - 2)
        return below, place - below


class DelayedFrames:
    """Reads simulated pictures late: centre lines at the stamps less each rollout's delay."""

    def __init__(self, stamps: np.ndarray, bounds: tuple[float, float] | None) -> None:
        """Of a camera's stamps (K,) [s]; `stamps` are those that a rollout must hold, sorted."""
        self._delay = Delay(bounds)
        early = stamps[:, None] - self._delay.values
        self.stamps, place = np.unique(early, return_inverse=True)
        self._place = place.reshape(early.shape)  # (K, values)

    def __call__(self, center_line: np.ndarray, delay: np.ndarray) -> np.ndarray:
        """Centre lines (N, len(stamps), L, 3) with delays (N,) as pictures, (N, K, L, 3)."""
        below, part = self._delay.between(delay)
        row = np.arange(len(center_line))[:, None]
        part = part.astype(center_line.dtype)[:, None, None, None]
        first = center_line[row, self._place[:, below].T]
        second = center_line[row, self._place[:, below + 1].T]
        return first + part * (second - first)


def along_axes(nuisances: dict[str, np.ndarray], name: str) -> np.ndarray | None:
    """The nuisances name_x, name_y, name_z as vectors (N, 3); None if there is none of them."""
    axes = [nuisances.get(f"{name}_{axis}") for axis in "xyz"]
    given = [axis for axis in axes if axis is not None]
    if not given:
        return None
    return np.stack([np.zeros_like(given[0]) if axis is None else axis for axis in axes], axis=1)
