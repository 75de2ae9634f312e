"""Integration in time by CVODE of SUNDIALS, whose steps and orders adapt, of compiled rates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from sksundae.cvode import CVODE

MOST_STEPS = 1_000_000  # between two times that are asked for


def integrated(
    rates: Callable[..., Any],
    y: np.ndarray,
    times: np.ndarray,
    data: Any,
    rtol: float,
    atol: float,
    *,
    event: Callable[..., Any] | None = None,
    **options: Any,
) -> tuple[np.ndarray, np.ndarray]:
    """Follow y (N,) from times[0], where it holds.

    Args:
        rates: Writes dy/dt into its third argument, of (time, y, dy/dt, data).
        times: To report at, ascending, shape (S,), three at least.
        event: Writes a value into its third argument, of (time, y, value (1,), data): the
            integration ends where that falls through zero.
        options: More of CVODE's.

    Returns:
        Times (R,) and states (R, N): those asked for, up to the event and with it.

    Raises:
        RuntimeError: CVODE did not get there.
    """
    if event is not None:
        options |= {"eventsfn": Falling(event), "num_events": 1}
    common = {"userdata": data, "rtol": rtol, "atol": atol, "max_num_steps": MOST_STEPS}
    solution = CVODE(rates, **common, **options).solve(times, y)
    if not solution.success:
        raise RuntimeError(f"the integration failed at {solution.t[-1]:g} s: {solution.message}")
    return solution.t, solution.y


class Falling:
    """An event where a value falls through zero, as scikit-sundae takes it."""

    def __init__(self, value: Callable[..., Any]) -> None:
        self.value, self.terminal, self.direction = value, [True], [-1]

    def __call__(self, time: float, y: np.ndarray, value: np.ndarray, data: Any) -> None:
        self.value(time, y, value, data)
