"""Trials: what the policies' draws, or a user's own, lead to beside what the simulator predicts.

One row a launch. `kind` says where the landing comes from: "virtual" (the rig, whose rubber is not
the simulator's), "measured" (a user's CSV) or "predicted" (nothing but the calibrated simulator).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from sling2sim2real.base.launches_file import CHECK, LaunchRow
from sling2sim2real.base.pool import Pool
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials.spread import landing_intervals
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.launch import Launches, limited
from sling2sim2real.simulator.parameters import Parameters

SCHEMA = pa.schema(
    [
        ("band", pa.string()),
        ("method", pa.string()),
        ("kind", pa.string()),  # virtual, measured or predicted
        ("target", pa.float64()),  # m; null where the launch had none
        ("draw_y", pa.float64()),  # m, as commanded
        ("draw_z", pa.float64()),
        ("predicted_y", pa.float64()),  # m, by the calibrated simulator; null where it fails
        ("predicted_low", pa.float64()),  # m, shortest 90 % by what is known of theta, law and draw
        ("predicted_high", pa.float64()),
        ("predicted_failure", pa.string()),
        ("predicted_leave_y", pa.float64()),  # m, where the simulated projectile leaves the pouch
        ("predicted_leave_z", pa.float64()),
        ("predicted_speed", pa.float64()),  # m/s, there
        ("predicted_angle", pa.float64()),  # rad above the horizon, there
        ("landing_y", pa.float64()),  # m, also outside the area; null where it did not land, and
        # for predictions
        ("flight_y", pa.list_(pa.float64())),  # m, from the pouch to the floor; null where none,
        ("flight_z", pa.list_(pa.float64())),  # and where not virtual
        ("hold_force", pa.float64()),  # N, of the rig where kind is virtual, else as predicted
        ("failure", pa.string()),
        ("stretch", pa.float64()),  # length of the drawn band over its rest length
        ("recorded_stretch", pa.float64()),  # largest of the recording
    ]
)


Trial = dict[str, Any]  # cells of a row by columns of SCHEMA; those that are not known are left out


def draws_of(trials: Sequence[Trial]) -> np.ndarray:
    """As commanded (y, z) [m], shape (N, 2)."""
    return np.array([(trial["draw_y"], trial["draw_z"]) for trial in trials], float)


def scored(launches: Sequence[LaunchRow], method: str) -> list[Trial]:
    """The launches to check a method's predictions with."""
    return [
        {
            "kind": "measured",
            "target": launch.target,
            "draw_y": launch.draw[0],
            "draw_z": launch.draw[1],
            "landing_y": launch.landing,
            "failure": "did not land" if launch.landing is None else None,
        }
        for launch in launches
        if launch.use == CHECK and launch.method in ("", method)
    ]


def aimed(stored: Stored, targets: Sequence[float]) -> list[Trial]:
    """What the policy would launch at the targets [m]. Raises UserError."""
    draws = stored.draws(np.array(targets)).tolist()
    return [
        {"kind": "predicted", "target": target, "draw_y": y, "draw_z": z}
        for target, (y, z) in zip(targets, draws, strict=True)
    ]


def launch_virtually(trials: Sequence[Trial], launch: Callable) -> list[Trial]:
    """Launch them in a virtual world; launches of equal target and number have equal errors.

    Every method has its targets in the same order, so a launch's place among them tells both.

    Args:
        launch: `launch(draw, place)` gives landing_y [m], NaN where there is none, failure,
            hold_force [N] and flight (K, 2) [m]. It goes to processes of its own: it keeps one core
            busy.
    """
    with Pool() as pool:
        tried = list(pool.map(launch, draws_of(trials), range(len(trials))))
    flights = ((None, None) if done.flight is None else done.flight.T for done in tried)
    return [
        trial
        | {"kind": "virtual", "landing_y": done.landing_y, "failure": done.failure}
        | {"hold_force": done.hold_force, "flight_y": y, "flight_z": z}
        for trial, done, (y, z) in zip(trials, tried, flights, strict=True)
    ]


def predicted(
    trials: Sequence[Trial],
    launcher: Callable[..., Launches],
    samples: Parameters | None,
    params: Settings,
) -> list[Trial]:
    """Trials with what the calibrated simulator makes of their draws.

    Args:
        launcher, samples: As `landing_intervals` has them.
        params: The whole of params.yaml.
    """
    draws = draws_of(trials)
    launches = limited(launcher(draws), params.setup.max_force)
    once, again = np.unique(draws, axis=0, return_inverse=True)
    error = params.trials.actuation_error
    intervals = landing_intervals(launcher, once, samples, error)[again]
    intervals[np.isnan(launches.landing_y)] = np.nan
    columns = {
        "predicted_y": launches.landing_y,
        "predicted_low": intervals[:, 0],
        "predicted_high": intervals[:, 1],
        "predicted_failure": launches.failure,
        "predicted_leave_y": launches.separation_y,
        "predicted_leave_z": launches.separation_z,
        "predicted_speed": launches.speed,
        "predicted_angle": launches.angle,
        "hold_force": launches.hold_force,
    }
    rows = (dict(zip(columns, cells, strict=True)) for cells in zip(*columns.values(), strict=True))
    return [row | trial for row, trial in zip(rows, trials, strict=True)]


def table(trials: Sequence[Trial], stretch: np.ndarray, **common: str | float) -> pa.Table:
    """Trials as a table of `SCHEMA`; what is NaN is not known.

    Args:
        stretch: Of each drawn band, shape (N,).
        common: What all have alike: band, method, recorded_stretch.
    """
    rows = []
    for trial, each in zip(trials, stretch, strict=True):
        cells = trial | {"stretch": each} | common
        unknown = [name for name, cell in cells.items() if np.isscalar(cell) and cell != cell]
        rows.append(cells | dict.fromkeys(unknown))
    return pa.Table.from_pylist(rows, schema=SCHEMA)
