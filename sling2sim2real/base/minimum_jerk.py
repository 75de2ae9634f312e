"""How a hand goes from one place of rest to another."""

from __future__ import annotations

import numpy as np


def minimum_jerk(part: np.ndarray | float) -> np.ndarray:
    """Share of a way that is behind at shares (...) of its time, 0 before it and 1 after.

    The way of the least mean squared jerk between two places of rest (Flash and Hogan 1985,
    10.1523/JNEUROSCI.05-07-01688.1985): speed and acceleration are 0 at both ends.
    """
    part = np.clip(part, 0, 1)
    return part**3 * (10 - 15 * part + 6 * part**2)
