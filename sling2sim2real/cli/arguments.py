"""What the `sling` command reads and prints: types of arguments, results as lines or JSON.

A type refuses what cannot be while the command line is read, before any work, and names the unit
that the number looks like.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Callable

from sling2sim2real.base.launches_file import LIMITS
from sling2sim2real.base.schema import Range
from sling2sim2real.settings.lab import BandParams, Topics

METRES = {"centimetres": 1e-2, "millimetres": 1e-3}
KILOGRAMS = {"grams": 1e-3}
PULLS = "informative", "paper"


def quantity(unit: str, low: float, high: float, units: dict[str, float], usual: float) -> Callable:
    """A type: a number of `unit` from `low` to `high`.

    Args:
        units: Smaller ones that it may be given in by mistake, and what they are worth.
        usual: A common value, which decides between them.
    """

    def read(text: str) -> float:
        value = number(text)
        if not low <= value <= high:
            readings = {name: value * worth for name, worth in units.items()}
            readings = {name: other for name, other in readings.items() if low <= other <= high}
            raise argparse.ArgumentTypeError(
                f"must be in {unit}, from {low:g} to {high:g}, got {text}{likely(readings, usual)}"
            )
        return value

    return read


def likely(readings: dict[str, float], usual: float) -> str:
    """A hint at the most usual of `readings`: what a number would be, by the unit it is in."""
    if not readings:
        return ""
    name = min(readings, key=lambda name: abs(math.log(readings[name] / usual)))
    return f", which looks like {name} ({readings[name]:.4g})"


def of_a_band(name: str, unit: str, units: dict[str, float], usual: float) -> Callable:
    """A type: a number of params.yaml's `bands`, within the range that it has there."""
    retained = BandParams.model_fields[name].metadata
    limits = next(constraint for constraint in retained if isinstance(constraint, Range))
    return quantity(unit, limits.low, limits.high, units, usual)


mass = of_a_band("mass", "kilograms", KILOGRAMS, 0.03)
diameter = of_a_band("diameter", "metres", METRES, 0.010)
rest_length = of_a_band("rest_length", "metres", METRES, 0.52)
target = quantity("metres", 0.1, LIMITS["landing"][1], METRES, 2.0)
landing = quantity("metres", 0.01, LIMITS["landing"][1], METRES, 2.0)
speed = quantity("m/s", 0.1, LIMITS["speed"][1], {}, 5.0)
angle = quantity("degrees", LIMITS["angle"][0], LIMITS["angle"][1], {}, 45.0)
distance = quantity("metres", 0.05, 2.0, METRES, 0.35)  # of a draw from the fork
draw_error = quantity("metres", 0.0, 0.05, METRES, 0.002)
rate = quantity("hertz", 1.0, 10_000.0, {}, 100.0)


def count(text: str) -> int:
    """A whole number above 0."""
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"must be a whole number above 0, got {text!r}")
    return int(text)


def number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"must be a number, got {text!r}")
    return value


def draw(text: str) -> tuple[float, float]:
    """A drawn position (y, z), frame O [m]."""
    parts = text.split(",")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"must be Y,Z such as --draw=-0.30,-0.17, got {text!r}")
    y, z = map(number, parts)
    if y >= 0:
        raise argparse.ArgumentTypeError(f"y must be below 0 (behind the fork), got {y:g}")
    try:
        distance(f"{math.hypot(y, z):.3g}")
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"its distance from the fork {error}") from None
    return y, z


def numbers(what: str, *quantities: Callable[[str], float]) -> Callable[[str], tuple[float, ...]]:
    """A type: numbers joined by commas, each of its own type; `what` names them, such as X,Y,Z."""

    def read(text: str) -> tuple[float, ...]:
        parts = text.replace(" ", "").strip("[]").split(",")
        if len(parts) != len(quantities):
            raise argparse.ArgumentTypeError(f"must be {what}, got {text!r}")
        return tuple(quantity(part) for quantity, part in zip(quantities, parts, strict=True))

    return read


def coordinate(text: str) -> float:
    """One of a place in a lab [m]."""
    value = number(text)
    if abs(value) > 10:
        hint = likely({"millimetres": abs(value) / 1e3}, 0.5)
        raise argparse.ArgumentTypeError(f"must be in metres, from -10 to 10, got {text}{hint}")
    return value


def pose(text: str) -> tuple[float, ...]:
    """X,Y,Z,QX,QY,QZ,QW: metres, and a quaternion of length 1."""
    read = numbers("X,Y,Z,QX,QY,QZ,QW", *3 * [coordinate], *4 * [number])(text)
    size = math.hypot(*read[3:])
    if abs(size - 1) > 1e-3:
        raise argparse.ArgumentTypeError(f"its quaternion must have length 1, not {size:.4g}")
    return read


point = numbers("X,Y,Z", *3 * [coordinate])
span = numbers("LOW,HIGH", coordinate, coordinate)
width = quantity("metres", 0.02, 2.0, METRES, 0.275)
force = quantity("newtons", 0.1, 1000.0, {}, 30.0)


MEASURED = {  # of `sling setup`: type, what stands for a value, help
    "left_tip": (point, "X,Y,Z", "of the fork, in the robot's base, as seen from the hand"),
    "right_tip": (point, "X,Y,Z", "the other one; x to the right, y towards the target"),
    "fork_width": (width, "M", "between the tips, by a ruler; default that of lab.yaml"),
    "base_to_camera": (pose, "POSE", "X,Y,Z,QX,QY,QZ,QW of the colour camera's optical frame"),
    "camera_to_fork": (pose, "POSE", "of the fork's frame O in that frame, if measured there"),
    "floor": (coordinate, "M", "height of the floor in the robot's base"),
    "max_force": (force, "N", "that the arm may hold"),
    "draw_y": (span, "LOW,HIGH", "draws that the arm reaches, frame O, such as -0.45,-0.25"),
    "draw_z": (span, "LOW,HIGH", "the same upwards, such as -0.30,-0.10"),
    "tool": (
        numbers("KG,X,Y,Z", number, *3 * [coordinate]),
        "KG,X,Y,Z",
        "that the sensor carries: mass, and its centre in the sensor's frame",
    ),
}
ROLES = tuple(Topics.model_fields)


def shown(content: dict, as_json: bool) -> str:
    """A flat result as one JSON object, or one line an entry."""
    if as_json:
        return json.dumps(content, allow_nan=False)
    width = max(map(len, content))
    return "\n".join(f"{key:{width}}  {readable(value)}" for key, value in content.items())


def readable(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return " ".join(map(readable, value)) or "-"
    return "-" if value is None else str(value)


def finite(value: float) -> float | None:
    """JSON has no NaN: what is not known is null."""
    return float(value) if math.isfinite(value) else None


def topic(text: str) -> tuple[str, str]:
    """A topic by its role, ROLE=TOPIC."""
    role, equals, name = text.partition("=")
    if role not in ROLES or not name:
        raise argparse.ArgumentTypeError(f"must be ROLE=TOPIC, of {', '.join(ROLES)}, got {text!r}")
    return role, name


def address(text: str) -> str:
    """Check that an argument is the address of a Dask scheduler."""
    if not re.fullmatch(r"(\w+://)?(\[.+\]|[^:/\s]+):\d{1,5}", text):
        raise argparse.ArgumentTypeError(f"must be such as tcp://10.0.0.5:8786, got {text!r}")
    return text
