"""What it takes to hold the drawn band, as far as anything is known of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.optimize import brentq

from sling2sim2real.api.identification import Identification
from sling2sim2real.base.errors import UserError
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.simulator.model import BandSizes

GENTLE = 1.25  # stretch of a first pull, where nothing is known of the force


@dataclass(frozen=True)
class Held:
    """The band held at a point by a string of neo-Hookean rubber, but for one factor.

    Its tension is in proportion to l - 1 / l^2 at a stretch l (Treloar 1975): the recorded force of
    one draw gives that of another, the better the less the stretches differ. From 1.63 to between
    1.3 and 2.1 it is 2 % off the simulator, and 11 to 13 % off the virtual rig's rubber.
    """

    half_width: float
    rest_length: float

    @classmethod
    def of(cls, band: BandSizes, setup: SetupParams) -> Held:
        return cls(setup.fork_width / 2, band.rest_length)

    def legs(self, point: np.ndarray) -> tuple[float, float]:
        """Stretch, and length of the sum of both halves' unit vectors."""
        ways = np.array([[-self.half_width, 0.0, 0.0], [self.half_width, 0.0, 0.0]]) - point
        lengths = np.linalg.norm(ways, axis=1)
        both = float(np.linalg.norm((ways / lengths[:, None]).sum(axis=0)))
        return float(lengths.sum()) / self.rest_length, both

    def stretch(self, point: np.ndarray) -> float:
        """Way from tip to point (3,) to tip, over the rest length."""
        return self.legs(point)[0]

    def force(self, point: np.ndarray) -> float:
        """Band's force on the hand at a point (3,), in units of a third of E A; 0 where slack."""
        stretch, both = self.legs(point)
        return max(stretch - stretch**-2, 0.0) * both

    def reach(self, value: Callable[[np.ndarray], float], limit: float, drawn: np.ndarray) -> float:
        """Share of the way to `drawn` (3,) at which a value that grows along it meets a limit."""
        part = brentq(lambda part: value(part * drawn) - limit, 1e-6, 1.0)
        return cast(float, part)


@dataclass(frozen=True)
class Prediction:
    """Force at the planned draw [N], None where nothing is known, and the source in words."""

    force: float | None
    source: str


def predict(held: Held, drawn: np.ndarray, found: Identification | None) -> Prediction:
    """The force at `drawn` (3,): by the simulator of an identified band, else unknown."""
    if found is not None:
        return Prediction(_simulated(found, drawn), "simulated with its θ")
    stretch, advice = held.stretch(drawn), ""
    if stretch > GENTLE:
        _, y, z = held.reach(held.stretch, GENTLE, drawn) * drawn
        advice = (
            f": begin with a shallow pull, --draw={y:.2f},{z:.2f}, and `sling fit` its recording,"
            " which tells the next plan"
        )
    source = f"not checked: the band is not identified; it is stretched to {stretch:.2f}{advice}"
    return Prediction(None, source)


def _simulated(found: Identification, drawn: np.ndarray) -> float:
    force = float(found.launches(drawn[1:]).hold_force[0])
    if not np.isfinite(force):
        raise UserError(
            f"{found.band.name}: the simulated hold of draw [{drawn[1]:g}, {drawn[2]:g}] does not"
            " converge: draw less far"
        )
    return force
