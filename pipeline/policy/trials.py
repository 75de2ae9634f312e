"""Trials: what the policy's draws, or a user's own, lead to beside what the simulator predicts.

One row a launch. `kind` says where the landing comes from: "virtual" (the rig, whose rubber is not
the simulator's), "measured" (a user's CSV) or "predicted" (nothing but the calibrated simulator).
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.episode import Episode
from pipeline.errors import UserError
from pipeline.files import replacing

SCHEMA = pa.schema(
    [
        ("band", pa.string()),
        ("method", pa.string()),
        ("kind", pa.string()),  # virtual, measured or predicted
        ("target", pa.float64()),  # m; null where the launch had none
        ("trial", pa.int64()),
        ("draw_y", pa.float64()),  # m, as commanded
        ("draw_z", pa.float64()),
        ("predicted_y", pa.float64()),  # m, by the calibrated simulator; null where it fails
        ("predicted_low", pa.float64()),  # m, central 90 % by what is known of theta, law and draw
        ("predicted_high", pa.float64()),
        ("predicted_failure", pa.string()),
        ("landing_y", pa.float64()),  # m; null where failed, and for predictions
        ("hold_force", pa.float64()),  # N, of the rig where kind is virtual, else as predicted
        ("failure", pa.string()),
        ("stretch", pa.float64()),  # length of the drawn band over its rest length
        ("recorded_stretch", pa.float64()),  # largest of the recording
    ]
)
REQUIRED = ("draw_y_m", "draw_z_m", "landing_y_m")
OPTIONAL = ("target_m", "method")


def stretch_of(points: np.ndarray, fork_width: float, rest_length: float) -> np.ndarray:
    """Length of the straight segments tip - point - tip over the rest length.

    Args:
        points: Where the band is held, frame O [m], shape (N, 3).
    """
    tips = np.array([[-fork_width / 2, 0, 0], [fork_width / 2, 0, 0]])
    return np.linalg.norm(points[:, None] - tips, axis=2).sum(1) / rest_length


def recorded_stretch(episode: Episode, fork_width: float, rest_length: float) -> float:
    """The largest stretch that the recording shows."""
    held = (episode.time >= episode.grasp_time) & (episode.time <= episode.release_time)
    return float(stretch_of(episode.position[held], fork_width, rest_length).max())


def read_measured(path: Path, method: str) -> list[dict]:
    """Measured launches of a CSV: those of `method`, and those that name no method.

    Columns draw_y_m, draw_z_m, landing_y_m, and where known target_m and method. An empty
    landing_y_m is a launch that did not land. Raises UserError.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            names = [name.strip() for name in reader.fieldnames or []]
            reader.fieldnames = names
            lines = list(enumerate(reader, start=2))
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not UTF-8 text, save it as CSV (UTF-8)") from error
    except (OSError, csv.Error) as error:
        raise UserError(f"{path}: cannot be read as CSV ({error})") from error
    missing = [name for name in REQUIRED if name not in names]
    unknown = [name for name in names if name not in REQUIRED + OPTIONAL]
    if missing or unknown:
        what = f"lacks the column {missing[0]}" if missing else f"unknown column {unknown[0]!r}"
        raise UserError(f"{path}: {what}; columns are {','.join(REQUIRED + OPTIONAL)}")
    rows = []
    for line, cells in lines:
        row = {name: (cells.get(name) or "").strip() for name in REQUIRED + OPTIONAL}
        if row["method"] not in ("", method):
            continue
        numbers = {name: _cell(path, line, name, row) for name in (*REQUIRED, "target_m")}
        if numbers["draw_y_m"] is None or numbers["draw_z_m"] is None:
            raise UserError(f"{path}, line {line}: a draw needs draw_y_m and draw_z_m")
        if numbers["draw_y_m"] >= 0:
            raise UserError(
                f"{path}, line {line}: draw_y_m must be below 0 (behind the fork),"
                f" got {numbers['draw_y_m']:g}"
            )
        rows.append(numbers)
    return rows


def _cell(path: Path, line: int, name: str, row: dict) -> float | None:
    text = row[name]
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"{path}, line {line}: {name} must be a number of metres, got {text!r}")
    return value


def table(
    *,
    band: str,
    method: str,
    kind: str,
    draws: np.ndarray,
    targets: list[float | None],
    predicted,
    intervals: np.ndarray,
    landing: list[float | None],
    failure: list[str | None],
    hold_force: np.ndarray,
    stretch: np.ndarray,
    recorded: float | None,
) -> pa.Table:
    """Trials as a table of `SCHEMA`.

    Args:
        draws: Commanded draws (y, z) [m], shape (N, 2).
        predicted: The calibrated simulator's launches of those draws.
        intervals: Where 90 % of them would land [m], shape (N, 2); NaN where that is not known.
        landing: Where they landed [m], None where nowhere or unknown.
        recorded: Largest stretch of the recording.
    """
    count = len(draws)
    seen: dict[float | None, int] = {}
    trial = []
    for target in targets:
        seen[target] = seen.get(target, 0) + 1
        trial.append(seen[target])
    columns = {
        "band": [band] * count,
        "method": [method] * count,
        "kind": [kind] * count,
        "target": targets,
        "trial": trial,
        "draw_y": draws[:, 0],
        "draw_z": draws[:, 1],
        "predicted_y": pa.array(predicted.landing_y, pa.float64(), from_pandas=True),
        "predicted_low": pa.array(intervals[:, 0], pa.float64(), from_pandas=True),
        "predicted_high": pa.array(intervals[:, 1], pa.float64(), from_pandas=True),
        "predicted_failure": predicted.failure,
        "landing_y": landing,
        "hold_force": pa.array(hold_force, pa.float64(), from_pandas=True),
        "failure": failure,
        "stretch": stretch,
        "recorded_stretch": [recorded] * count,
    }
    return pa.table(columns, schema=SCHEMA)


def save(trials: pa.Table, path: Path) -> None:
    with replacing(path) as temporary:
        pq.write_table(trials, temporary)
