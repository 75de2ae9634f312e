"""Whether a band changed between its recordings, by values and what each leaves open of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.stats import norm

from pipeline.base.schema import JsonRecord

FALSE_ALARM = 0.05  # chance of any finding for a band that did not change


class ValueOfRecording(JsonRecord):
    """What one recording alone says of a positive quantity.

    Attributes:
        value: The most likely one [SI].
        low, high: Of its 90 % interval.
        deviation: Standard deviation of its logarithm.
    """

    value: float
    low: float
    high: float
    deviation: float


@dataclass(frozen=True)
class ChangeOfBand:
    """A quantity that is another in a later recording.

    Attributes:
        quantity: Its name.
        earlier, later: Numbers of the recordings, from 0 on.
        ratio: Later value over the earlier one.
        chance: Of a difference as large anywhere, if nothing changed; at most FALSE_ALARM.
    """

    quantity: str
    earlier: int
    later: int
    ratio: float
    chance: float


def changes(values: Mapping[str, Sequence[ValueOfRecording]]) -> list[ChangeOfBand]:
    """Differences that chance does not explain, the surest first.

    The difference of two logarithms over the root of the sum of their variances is normal, if the
    recordings err independently. Bonferroni: its two-sided tail times the number of comparisons,
    every pair of recordings in every quantity, stays below FALSE_ALARM.

    Args:
        values: In the order of time, of each quantity as many as there are recordings.
    """
    compared = [
        (name, pair)
        for name, series in values.items()
        for pair in combinations(range(len(series)), 2)
    ]
    ranked = []
    for name, (earlier, later) in compared:
        first, other = values[name][earlier], values[name][later]
        gap = np.log(other.value / first.value)
        sigmas = abs(gap) / np.hypot(first.deviation, other.deviation)
        chance = 2 * norm.sf(sigmas) * len(compared)
        if chance < FALSE_ALARM:
            change = ChangeOfBand(name, earlier, later, float(np.exp(gap)), float(chance))
            ranked.append((-sigmas, change))
    return [change for _, change in sorted(ranked, key=lambda rank: rank[0])]


def newest(changed: Sequence[ChangeOfBand]) -> int:
    """Number of the first recording from which on none differs; 0 where none changed at all."""
    return max((change.earlier + 1 for change in changed), default=0)
