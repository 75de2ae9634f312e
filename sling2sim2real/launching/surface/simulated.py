"""Where a draw lands, simulated whenever it is asked: the paper's way to train."""

from __future__ import annotations

import numpy as np

from sling2sim2real.launching.surface.landing_map import (
    NO_FAILURE,
    TOO_MUCH_FORCE,
    LandingMap,
    Landings,
    Launcher,
)
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.simulator.parameters import Parameters


class SimulatedLandings:
    """Landings in the place of a `LandingMap`: each draw is launched in the simulator.

    Attributes:
        reasons: Names of the failure codes, more with each new one; code 0 is success.
        low, high: Corners of the box of draws [m], shape (2,).
    """

    def __init__(self, launcher: Launcher, setup: SetupParams) -> None:
        """Launch in the box and under the force limit of `setup`.

        Args:
            launcher: Simulates draws, shape (N, 2) [m], without a force limit of its own.
        """
        self.launcher, self.max_force = launcher, setup.max_force
        self.low, self.high = np.array([setup.draw_y, setup.draw_z], float).T
        self.reasons = [NO_FAILURE, TOO_MUCH_FORCE]

    def __call__(self, draws: np.ndarray, *theta: Parameters) -> Landings:
        """Landings of draws, shape (N, 2) [m]; each with its own θ, where they are given."""
        launched = self.launcher(np.asarray(draws, float), *theta)
        force = np.asarray(launched.hold_force, float)
        failure = np.array([self._code(reason) for reason in launched.failure], int)
        failure = np.where((failure == 0) & (force > self.max_force), 1, failure)
        landing = np.asarray(launched.landing_y, float)
        return Landings(np.where(failure > 0, np.nan, landing), force, failure)

    def _code(self, reason: str | None) -> int:
        name = reason or NO_FAILURE
        if name not in self.reasons:
            self.reasons.append(name)
        return self.reasons.index(name)


Source = LandingMap | SimulatedLandings  # of landings
