"""Trials: what the policies' draws, or a user's own, lead to beside what the simulator predicts.

One row a launch. `kind` says where the landing comes from: "virtual" (the rig, whose rubber is not
the simulator's), "measured" (a user's CSV) or "predicted" (nothing but the calibrated simulator).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sling2sim2real.base.files import replacing
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
        ("trial", pa.int64()),  # counts launches at a target; virtual ones of equal target and
        # number are off by the same errors, whatever the method
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


@dataclass(frozen=True)
class Batch:
    """N launches of one kind and policy; a cell, or all, is None where there is nothing to tell.

    Attributes:
        draws: As commanded (y, z) [m], shape (N, 2).
        targets: Aimed at [m].
        landing: Where they landed [m], also where that counts as a failure.
        failure: Why they count for nothing.
        hold_force: Of the drawn band on the hand [N]; None: as predicted.
        flight: Way of the projectile (y, z) [m], shape (K, 2) each.
    """

    kind: str
    draws: np.ndarray
    targets: list[float | None]
    landing: list[float | None] | None = None
    failure: list[str | None] | None = None
    hold_force: list[float | None] | None = None
    flight: list[np.ndarray | None] | None = None

    def every(self, name: str) -> list:
        """What an attribute tells of each launch."""
        column_values = getattr(self, name)
        return [None] * len(self.draws) if column_values is None else list(column_values)


def scored(launches: Sequence[LaunchRow], method: str) -> list[Batch]:
    """The launches to check a method's predictions with, if there are any."""
    chosen = [
        launch for launch in launches if launch.use == CHECK and launch.method in ("", method)
    ]
    if not chosen:
        return []
    landing = [launch.landing for launch in chosen]
    failure = [None if y is not None else "did not land" for y in landing]
    draws, targets = (
        np.array([launch.draw for launch in chosen]),
        [launch.target for launch in chosen],
    )
    return [Batch("measured", draws, targets, landing, failure)]


def aimed(stored: Stored, targets: list[float]) -> Batch:
    """What the policy would launch at the targets [m]. Raises UserError."""
    return Batch("predicted", stored.draws(np.array(targets)), list(targets))


def launch_virtually(batch: Batch, launch: Callable) -> Batch:
    """Launch a batch in a virtual world; launches of equal target and number have equal errors.

    Every method's batch has its targets in the same order, so a launch's place in it tells both.

    Args:
        launch: `launch(draw, place)` gives landing_y [m], NaN where there is none, failure,
            hold_force [N] and flight. It goes to processes of its own: it keeps one core busy.
    """
    with Pool() as pool:
        tried = list(pool.map(launch, batch.draws, range(len(batch.draws))))
    landing = [trial.landing_y if np.isfinite(trial.landing_y) else None for trial in tried]
    names = ("failure", "hold_force", "flight")
    column_values = {name: [getattr(trial, name) for trial in tried] for name in names}
    return replace(batch, kind="virtual", landing=landing, **column_values)


def predict(
    batches: list[Batch],
    launcher: Callable[..., Launches],
    samples: Parameters | None,
    params: Settings,
) -> tuple[Launches, np.ndarray]:
    """What the calibrated simulator makes of the draws of all batches, N in all.

    Args:
        launcher, samples: As `landing_intervals` has them.
        params: The whole of params.yaml.

    Returns:
        Its launches, limited by the arm, and where 90 % of them would land [m], shape (N, 2); NaN
        where that is not known.
    """
    draws = np.concatenate([batch.draws for batch in batches])
    launches = limited(launcher(draws), params.setup.max_force)
    once, again = np.unique(draws, axis=0, return_inverse=True)
    error = params.trials.actuation_error
    intervals = landing_intervals(launcher, once, samples, error)[again]
    intervals[np.isnan(launches.landing_y)] = np.nan
    return launches, intervals


def table(
    band: str,
    method: str,
    batches: list[Batch],
    *,
    predicted: Launches,
    intervals: np.ndarray,
    stretch: np.ndarray,
    recorded: float | None,
) -> pa.Table:
    """Trials as a table of `SCHEMA`, batch after batch; N launches in all.

    Args:
        predicted: The calibrated simulator's launches of their draws.
        intervals: Where 90 % of them would land [m], shape (N, 2); NaN where that is not known.
        stretch: Of the drawn band, shape (N,).
        recorded: Largest stretch of the recording.
    """

    def every(name: str) -> list:
        return [value for batch in batches for value in batch.every(name)]

    def each(name: str) -> list:
        return [getattr(batch, name) for batch in batches for _ in batch.draws]

    def finite_or_none(values: np.ndarray | list) -> pa.Array:
        return pa.array(values, pa.float64(), from_pandas=True)

    force = zip(every("hold_force"), predicted.hold_force, strict=True)
    columns = {
        "band": [band] * len(stretch),
        "method": [method] * len(stretch),
        "kind": each("kind"),
        "target": every("targets"),
        "trial": [number for batch in batches for number in _counted(batch.targets)],
        "draw_y": [y for y, _ in every("draws")],
        "draw_z": [z for _, z in every("draws")],
        "predicted_y": finite_or_none(predicted.landing_y),
        "predicted_low": finite_or_none(intervals[:, 0]),
        "predicted_high": finite_or_none(intervals[:, 1]),
        "predicted_failure": predicted.failure,
        "predicted_leave_y": finite_or_none(predicted.separation_y),
        "predicted_leave_z": finite_or_none(predicted.separation_z),
        "predicted_speed": finite_or_none(predicted.speed),
        "predicted_angle": finite_or_none(predicted.angle),
        "landing_y": every("landing"),
        "flight_y": [None if way is None else way[:, 0] for way in every("flight")],
        "flight_z": [None if way is None else way[:, 1] for way in every("flight")],
        "hold_force": finite_or_none(
            [
                theirs if measured_force is None else measured_force
                for measured_force, theirs in force
            ]
        ),
        "failure": every("failure"),
        "stretch": stretch,
        "recorded_stretch": [recorded] * len(stretch),
    }
    return pa.table(columns, schema=SCHEMA)


def _counted(targets: list[float | None]) -> list[int]:
    """How many launches a target has had with each, from 1."""
    return [targets[: i + 1].count(target) for i, target in enumerate(targets)]


def save(trials: pa.Table, path: Path) -> None:
    with replacing(path) as temporary:
        pq.write_table(trials, temporary)
