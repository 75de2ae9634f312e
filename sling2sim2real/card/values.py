"""A band's values with their intervals, as people read them."""

from __future__ import annotations

from dataclasses import dataclass

from sling2sim2real.quantities import QUANTITIES, rounded
from sling2sim2real.simulator.parameters import EXTRA


@dataclass(frozen=True)
class ShownValue:
    """One value in its quantity's unit.

    Attributes:
        low, high: None where no interval is known.
        prior: Interval of what is known without the recording; None where it is not.
        identified: The recording says more than that.
    """

    name: str
    label: str
    unit: str
    value: float
    low: float | None
    high: float | None
    fixed: bool
    prior: tuple[float, float] | None = None
    identified: bool = True

    @property
    def outside(self) -> bool:
        """The value lies outside its own prior's interval."""
        return bool(self.prior and not self.prior[0] <= self.value <= self.prior[1])


def values(theta: dict, fixed: dict[str, float]) -> list[ShownValue]:
    """Values of a θ file's content, in the order of QUANTITIES.

    Args:
        fixed: Parameters that the method did not search.
    """
    confidence = theta.get("confidence") or {}
    intervals = {**confidence.get("derived", {}), **confidence.get("parameters", {})}
    numbers_of = dict(theta["theta"])
    if confidence:  # else nothing was searched but θ
        numbers_of["air_drag"] = theta.get("nuisances", {}).get("air_drag") or 0.0
        numbers_of |= {name: theta[name] for name in EXTRA if name in theta}
    shown_values = []
    for name, quantity in QUANTITIES.items():
        if name not in numbers_of:
            continue
        value, interval = rounded(quantity.factor * numbers_of[name]), intervals.get(name, {})
        still = name in fixed
        ends = (None if still else interval.get(end) for end in ("low", "high"))
        low, high = (None if x is None else rounded(quantity.factor * x) for x in ends)
        prior, identified = interval.get("prior"), interval.get("identifiable", True)
        if prior:
            prior = rounded(quantity.factor * prior[0]), rounded(quantity.factor * prior[1])
        cells = quantity.label, quantity.unit, value, low, high, still, prior, identified
        shown_values.append(ShownValue(name, *cells))
    return shown_values
