"""What an export asks of a calibrated band."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from sling2sim2real.identification.results.theta import Mounting
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.launch import Launches
from sling2sim2real.simulator.model import BandSizes, ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters


class NamedBand(BandSizes, Protocol):
    """A band's sizes, and what it is called."""

    @property
    def name(self) -> str: ...


class CalibratedBand(Protocol):
    """A band that can be simulated, as `sling2sim2real.Model` is one."""

    @property
    def band(self) -> NamedBand: ...
    @property
    def parameters(self) -> Parameters: ...
    @property
    def mounting(self) -> Mounting | None: ...
    @property
    def settings(self) -> Settings: ...
    @property
    def sling(self) -> ClampedBand: ...
    @property
    def launch_setup(self) -> LaunchSetup: ...
    def launches(self, draws: np.ndarray, points: np.ndarray | None = None) -> Launches:
        """Launch draws (N, 2) [m], each with a θ of its own where `points` (N, P) are given."""
        ...
