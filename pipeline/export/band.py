"""What an export asks of a calibrated band, and a planned pull of it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pipeline.episode.episode import Episode
from pipeline.episode.planned import planned_pull
from pipeline.identify.results.mounting import Mounting
from pipeline.params import Params
from pipeline.simulator.initial import hanging_guess
from pipeline.simulator.launch import Launches
from pipeline.simulator.model import BandSizes, ClampedBand, LaunchSetup
from pipeline.simulator.parameters import Parameters


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
    def settings(self) -> Params: ...
    @property
    def sling(self) -> ClampedBand: ...
    @property
    def launch_setup(self) -> LaunchSetup: ...
    def launches(self, draws: np.ndarray) -> Launches:
        """Launch draws (N, 2) [m]."""
        ...


def pull_to(model: CalibratedBand, draw: tuple[float, float]) -> Episode:
    """A planned pull to a draw (y, z), frame O [m]."""
    hanging = hanging_guess(model.sling)[model.sling.middle, 2]
    return planned_pull(model.settings.episode, model.band.name, hanging, draw)
