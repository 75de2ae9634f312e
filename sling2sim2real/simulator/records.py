"""What the numbers mean that pass between NumPy and the native text: one list for both.

A record is a NumPy type of named numbers and vectors. The text gets its places as macros: STEP_TIME
of a step's time, STEP_TARGET of the first number of its target, STEP_SIZE; GRIP_HELD of a code.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from sling2sim2real.simulator.rubber import BRANCH_TIMES_S

BRANCHES = len(BRANCH_TIMES_S)


def _record(*fields: str | tuple[str, int]) -> np.dtype:
    """Type of a record of numbers, and of vectors of so many of them."""
    return np.dtype(
        [
            (field, float) if isinstance(field, str) else (field[0], float, field[1:])
            for field in fields
        ]
    )


class Mode(IntEnum):
    """Mode of a step: RELAX begins without speed and feels no air."""

    RELAX, MOVE = range(2)


class Grip(IntEnum):
    """What holds the middle: nothing, closed pads, opening pads, the pouch in the hand."""

    FREE, HELD, OPENING, POUCH = range(4)


class Outcome(IntEnum):
    """Outcome of a sling's steps; SEPARATED: the projectile has left the pouch."""

    SEPARATED, GOING_ON, NOT_CONVERGED, SLIPPED = range(-1, 3)


# what all slings of a batch share; `shortest`: edge
SETTING = _record(
    "mean_edge", "area", "radius2", "line_mass", "wind", "gravity", "tolerance", "step_limit",
    "max_iterations", ("clamped", 2), "shortest",
)  # fmt: skip
# of a sling's law: material.py computes them, state.h takes them to material.h and rod.h
MATERIAL = _record(
    "mu",
    "lam",
    "damping",
    "scale",
    "friction",
    "bending",
    "drag",
    "mooney",
    "upturn",
    "softening",
    "relaxation",
    "flow",
    "flow_rate",
    "turning",
)
# of a step that ends at `time` and is `h` long: past and beta as in step.h; Mode, Grip; where the
# hand is; its normal force (for opening pads, how much of it is gone); how much of the way from
# where it grasped the band to its own path is left; share of the bending stiffness; metres that the
# hand gives way per newton; rubber.update
STEP = _record(
    "h", "past", "beta", "mode", "grip", ("target", 3), "grip_force", "blend", "time", "bending",
    "compliance", ("forget", BRANCHES), ("follow", BRANCHES),
)  # fmt: skip
# of a sling on its way: direction of the launch, mass of the projectile, Outcome; time, y, z, vy,
# vz at the separation; lowest z until then; force on the hand when it last held; Newton
# iterations, its neighbours' too; what share of a stress at rest the branches carry besides; the
# work of the largest stretch before (rubber.h)
LANE = _record(
    ("direction", 3), "payload", "outcome", ("separation", 5), "lowest", ("hold_force", 3),
    "iterations", ("unrelaxed", BRANCHES), "unflowed", "worst",
)  # fmt: skip
# what is put out of a step
OUTPUT = _record(("force", 3), "iterations")

_RECORDS = {
    "SETTING": SETTING, "MATERIAL": MATERIAL, "STEP": STEP, "LANE": LANE, "OUTPUT": OUTPUT
}  # fmt: skip


def width(record: np.dtype) -> int:
    """Numbers in it."""
    return record.itemsize // 8


def numbers(records: np.ndarray) -> np.ndarray:
    """Records (N,) as rows (N, width)."""
    return np.ascontiguousarray(records).view(float).reshape(len(records), -1)


def records(rows: np.ndarray, record: np.dtype) -> np.ndarray:
    """Rows (N, width) as records (N,)."""
    return np.ascontiguousarray(rows, float).view(record)[:, 0]


def macros() -> dict[str, int | str]:
    """Places of the records' fields, their sizes, and the codes, for the native text."""
    result: dict[str, int | str] = {}
    result |= {f"{name}_SIZE": width(record) for name, record in _RECORDS.items()}
    for name, record in _RECORDS.items():
        for field, (_, offset, *_) in (record.fields or {}).items():
            result[f"{name}_{field.upper()}"] = offset // 8
    for codes in (Mode, Grip, Outcome):
        result |= {f"{codes.__name__.upper()}_{code.name}": f"({code:d})" for code in codes}
    return result
