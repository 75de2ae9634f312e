"""One pull with every step's result: stamps, signals, scene, clouds, and what they tell."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from sling2sim2real.recording.cloud import Clouds, clouds_of
from sling2sim2real.recording.coverage import PictureLine, over_time, taut_coverage
from sling2sim2real.recording.delays import Delays, correct_delays
from sling2sim2real.recording.pulls import Pull
from sling2sim2real.recording.signals import Signals, signals_of
from sling2sim2real.recording.tips import Tips, measure_tips
from sling2sim2real.recording.view import Scene, View
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandParams


@dataclass(frozen=True)
class Processed:
    """Every step's result for one pull: its delays, then signals, scene, view, clouds, in order.

    What is below `delays` is computed when first asked for.

    Attributes:
        pull: With the stamps corrected by `delays`.
        weighed: Whether the band's mass is known: without it nothing is judged by the weight.
    """

    pull: Pull
    delays: Delays
    band: BandParams
    params: Settings
    weighed: bool = True

    @classmethod
    def of(cls, pull: Pull, band: BandParams, params: Settings, weighed: bool = True) -> Self:
        """Correct the delays of its streams. Raises UserError."""
        return cls(*correct_delays(pull, params), band, params, weighed)

    @cached_property
    def signals(self) -> Signals:
        """Raises UserError."""
        return signals_of(self.pull, self.params, self.delays.tool_inertia)

    @property
    def start(self) -> float:
        """Start of the window, since the file's first force [s]. Raises UserError."""
        return (self.signals.origin - self.pull.recording.origin) * 1e-9

    @cached_property
    def scene(self) -> Scene:
        """Raises UserError."""
        return Scene.of(self.band, self.params.setup, self.signals)

    @cached_property
    def view(self) -> View:
        """Raises UserError."""
        duration = self.signals.duration
        return View(self.pull.recording, self.pull.geometry, self.scene, duration)

    @cached_property
    def clouds(self) -> Clouds:
        """Raises UserError."""
        return clouds_of(self.view, self.params.cloud)

    @cached_property
    def coverage(self) -> list[PictureLine]:
        """A row a picture. Raises UserError."""
        return over_time(self.scene, self.clouds, self.start)

    @cached_property
    def taut_coverage(self) -> tuple[float | None, float | None]:
        """Return what `coverage.taut_coverage` finds for this pull. Raises UserError."""
        return taut_coverage(self.scene, self.clouds)

    @cached_property
    def tips(self) -> Tips | None:
        """None where too little of the drawn band is seen. Raises UserError."""
        eye = self.pull.geometry.camera.translation
        clamp = np.array(self.params.setup.clamp_direction)
        return measure_tips(self.scene, self.clouds.time, self.clouds.points, eye, clamp)
