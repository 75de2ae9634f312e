"""Within which a method searches each parameter, and whether a value is at the edge of that."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sling2sim2real.base.parameters import parameters
from sling2sim2real.settings import Settings

EDGE = 0.01  # of a range's width: as near is at its edge


class SearchedRange(NamedTuple):
    """A range [SI]; `scale` is linear or log."""

    low: float
    high: float
    scale: str = "linear"

    def place(self, value: float) -> float:
        """Place of a value in the range, from 0 at the lower end to 1 at the upper one."""
        ends = np.array([value, self.low, self.high], float)
        if self.scale == "log":
            ends = np.log(ends)
        return float((ends[0] - ends[1]) / (ends[2] - ends[1]))

    def at(self, place: np.ndarray) -> np.ndarray:
        """Values at places in the range: the inverse of `place`."""
        if self.scale == "log":
            return self.low * (self.high / self.low) ** place
        return self.low + place * (self.high - self.low)

    def edge(self, value: float) -> str:
        """At which end a value is, "lower" or "upper": the optimum may lie beyond; else "".

        A lower end of 0 is nature's, and so no edge.
        """
        place = self.place(value)
        if place > 1 - EDGE:
            return "upper"
        return "lower" if place < EDGE and self.low != 0 else ""


def at_edges(params: Settings, method: str, theta: Mapping[str, float]) -> dict[str, str]:
    """Values of θ at an edge of what a method searches: "lower" or "upper" by name."""
    ranges = searched(params, method)
    edges = {name: ranges[name].edge(theta[name]) for name in ranges if name in theta}
    return {name: side for name, side in edges.items() if side}


def searched(params: Settings, method: str) -> dict[str, SearchedRange]:
    """Ranges of what a method searches, by name."""
    config = params.methods[method]
    ranges = {name: SearchedRange(box.low, box.high, box.scale) for name, box in params.parameters}
    ranges |= {
        name: ranges.get(name, SearchedRange(0, 1))._replace(low=low, high=high)
        for name, (low, high) in config.bounds.items()
    }
    for row in parameters(config.law):
        if row.coordinate and row.coordinate.bounds:
            low, high = row.coordinate.bounds
            if row.coordinate.log:
                low, high = float(np.exp(low)), float(np.exp(high))
            ranges[row.name] = SearchedRange(low, high, "log" if row.coordinate.log else "linear")
    return {name: box for name, box in ranges.items() if name not in config.fixed}
