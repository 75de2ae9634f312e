"""One definition of a check, for the report and for the tests alike."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Measure:
    """A figure of the simulator and what it may be at most.

    Attributes:
        name: What is compared.
        against: What it is held against: a closed form, the reference, finer steps.
        value: How far off it is, or the figure itself, in `unit`.
        limit: The most it may be.
        note: What a reader of the figure should know.
    """

    name: str
    against: str
    value: float
    unit: str
    limit: float
    note: str = ""

    @property
    def met(self) -> bool:
        """Whether the figure keeps its limit; what is no number never does."""
        return bool(math.isfinite(self.value) and self.value <= self.limit)


@dataclass(frozen=True)
class Theme:
    """A theme of the report.

    Attributes:
        text: Markdown before the table.
        not_run: Why there is nothing; empty where there is.
    """

    title: str
    checks: list[Measure]
    text: str = ""
    not_run: str = ""


@dataclass(frozen=True)
class Bench:
    """Where checks run; `params` is params.yaml."""

    params: object
    device: str = "cpu"
    workers: int = 1

    @property
    def on(self) -> dict:
        """Where simulations run, as options of theirs."""
        return {"device": self.device, "workers": self.workers}


def off(value, expected) -> float:
    """Largest deviation from `expected` in percent of it; NaN where a value is none."""
    ratio = np.asarray(value, float) / np.asarray(expected, float) - 1
    return float(100 * np.abs(ratio).max())


def unmet(checks: Iterable[Measure]) -> list[Measure]:
    return [check for check in checks if not check.met]
