"""What the `sling` command reads and prints: types of arguments, results as lines or JSON."""

from __future__ import annotations

import argparse
import json
import math
import re

FURTHEST_TARGET = 100.0  # m


def positive(text: str) -> float:
    """A finite number above 0."""
    value = number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"must be above 0, got {text}")
    return value


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


def target(text: str) -> float:
    """A distance along the floor that a slingshot may be asked for [m]."""
    value = positive(text)
    if value > FURTHEST_TARGET:
        raise argparse.ArgumentTypeError(f"must be at most {FURTHEST_TARGET:g} m, got {text}")
    return value


def draw(text: str) -> tuple[float, float]:
    """A drawn position (y, z), frame O [m]."""
    parts = text.split(",")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"must be Y,Z such as --draw=-0.30,-0.17, got {text!r}")
    y, z = map(number, parts)
    if y >= 0:
        raise argparse.ArgumentTypeError(f"y must be below 0 (behind the fork), got {y:g}")
    return y, z


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


def address(text: str) -> str:
    """Of a Dask scheduler."""
    if not re.fullmatch(r"(\w+://)?(\[.+\]|[^:/\s]+):\d{1,5}", text):
        raise argparse.ArgumentTypeError(f"must be such as tcp://10.0.0.5:8786, got {text!r}")
    return text
