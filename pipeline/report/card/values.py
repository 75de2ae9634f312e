"""A band's values with their intervals, as people read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pipeline.identify.posterior.coordinates import MOST_DRAG, MOST_LOST
from pipeline.simulator.parameters import EXTRA


class Label(NamedTuple):
    """Name, unit, and the factor from SI to it."""

    text: str
    unit: str = ""
    factor: float = 1.0


LABELS = {
    "youngs_modulus": Label("Young's modulus", "kPa", 1e-3),
    "mooney_share": Label("Mooney share"),
    "relaxation": Label("relaxation a half decade", "%", 100.0),
    "elasticity_damping": Label("damping time", "ms", 1e3),
    "damping_scale": Label("damping scale"),
    "poissons_ratio": Label("Poisson's ratio"),
    "dynamic_friction": Label("friction of the pads"),
    "air_drag": Label("drag beyond a cylinder's", "1/s"),
    "turn_damping": Label("damping of turns"),
    "returned_share": Label("energy that a launch returns", "%", 100.0),
}
DIGITS = 3


@dataclass(frozen=True)
class ShownValue:
    """One value in its label's unit; `low` and `high` are None where no interval is known."""

    name: str
    label: str
    unit: str
    value: float
    low: float | None
    high: float | None
    fixed: bool


def values(theta: dict, fixed: dict[str, float]) -> list[ShownValue]:
    """Of a θ file's content, in the order of LABELS.

    Args:
        fixed: Parameters that the method did not search.
    """
    told = theta.get("confidence") or {}
    intervals = {**told.get("derived", {}), **told.get("parameters", {})}
    known = theta["theta"] | {"air_drag": theta.get("nuisances", {}).get("air_drag") or 0.0}
    known |= {name: theta[name] for name in EXTRA if name in theta}
    if not told:  # nothing was searched but θ
        known = theta["theta"]
    found = []
    for name, label in LABELS.items():
        if name not in known:
            continue
        numbers = known[name], *(intervals.get(name, {}).get(end) for end in ("low", "high"))
        shown = [None if x is None else rounded(label.factor * x) for x in numbers]
        still = name in fixed
        ends = (None, None) if still else shown[1:]
        found.append(ShownValue(name, label.text, label.unit, shown[0], *ends, still))
    return found


def rounded(value: float, digits: int = DIGITS) -> float:
    """To so many digits: another kind of CPU differs beyond them."""
    return float(f"{value:.{digits}g}")


def boxes(params, method: str) -> dict[str, tuple[float, float, str]]:
    """Low and high end in SI, and scale, of what a method searches, by name."""
    about = params.methods[method]
    known = {name: (box.low, box.high, box.scale) for name, box in params.parameters}
    known |= {name: (*ends, "linear") for name, ends in about.bounds.items()}
    known |= {
        "air_drag": (0.0, MOST_DRAG, "linear"),
        "turn_damping": (0.0, 1.0, "linear"),
        "returned_share": (np.exp(-MOST_LOST), np.exp(MOST_LOST), "log"),
    }
    return {name: box for name, box in known.items() if name not in about.fixed}
