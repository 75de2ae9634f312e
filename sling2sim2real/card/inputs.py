"""All that a band's card is made from, read and launched once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from sling2sim2real.api.identification import Identification
from sling2sim2real.base.launches_file import CHECK, LaunchRow
from sling2sim2real.episode.episode import Episode
from sling2sim2real.launching.trials.spread import Spread, landing_spread
from sling2sim2real.launching.trials.stretch import recorded_stretch, stretch_of
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.launch import Launches, limited
from sling2sim2real.simulator.parameters import Parameters

LAUNCHED = ("kind", "landing_y", "predicted_y", "predicted_low", "predicted_high", "stretch")


@dataclass(frozen=True)
class Aims:
    """T targets, and the draws for them, launched in the calibrated simulator.

    Attributes:
        target, landing, hold_force: [m], [m], [N], shape (T,); a landing is NaN where it fails.
        draw: (y, z) [m], shape (T, 2).
        interval: Of 90 % of the landings, the shortest [m], shape (T, 2); NaN where not known.
        failure: None, or why a launch fails, length T.
        stretch: Of the drawn band, shape (T,).
        spread: Of the landings.
    """

    target: np.ndarray
    draw: np.ndarray
    landing: np.ndarray
    interval: np.ndarray
    hold_force: np.ndarray
    failure: list[str | None]
    stretch: np.ndarray
    spread: Spread

    @property
    def half_width(self) -> np.ndarray:
        """Half widths of the intervals [m], shape (T,)."""
        return np.diff(self.interval, axis=1)[:, 0] / 2

    @property
    def median(self) -> np.ndarray:
        """Median landings of the samples of θ [m], shape (T,); NaN where any fails."""
        return np.median(self.spread.centres, axis=1)


def sides(landing: float, interval: np.ndarray) -> str:
    """How far an interval reaches to either side of a landing [cm], as in "−70/+8"."""
    low, high = 100 * (np.asarray(interval) - landing)
    return f"{low:+.0f}/{high:+.0f}".replace("-", "−")


@dataclass(frozen=True)
class CardInputs:
    """Inputs of a band's card.

    Attributes:
        found: The identified band.
        method: By which it was.
        episodes: Of all its pulls; pictures show the first.
        launched: Launches that landed somewhere, beside what was predicted: columns LAUNCHED.
        aims: At `trials.targets`.
        trained: Whether the training of its policy converged; None where it has none.
        virtual: It is a band of the virtual rig.
        assumed: Names of sizes that nobody has measured.
    """

    found: Identification
    method: str
    episodes: Sequence[Episode]
    launched: pd.DataFrame
    aims: Aims
    trained: bool | None = None
    virtual: bool = False
    assumed: Sequence[str] = field(default=())

    @property
    def params(self) -> Settings:
        return self.found.settings

    @property
    def band(self) -> str:
        return self.found.band.name

    @property
    def theta(self) -> dict:
        """What a θ file says of the band."""
        return self.found.content()

    @property
    def confidence(self) -> dict:
        return self.found.confidence

    @property
    def episode(self) -> Episode:
        return self.episodes[0]

    @property
    def launches(self) -> int:
        """Number of launches that are evidence."""
        return len(self.confidence.get("launches", []))

    @property
    def recordings(self) -> list[str]:
        """Names of the files that the episodes are of."""
        return list(dict.fromkeys(episode.metadata["input"]["file"] for episode in self.episodes))

    @property
    def recorded_stretch(self) -> float:
        """The largest of all pulls."""
        setup = self.params.setup
        return recorded_stretch(self.episodes, setup.fork_width, self.found.band.rest_length)


def stretches(found: Identification, draws: np.ndarray) -> np.ndarray:
    """How far draws (N, 2) [m] stretch a band, shape (N,)."""
    sizes = found.settings.setup.fork_width, found.band.rest_length
    return stretch_of(np.insert(draws, 0, 0, axis=1), *sizes)


def predicted(
    found: Identification, draws: np.ndarray, error: float | None = None
) -> tuple[Launches, Spread]:
    """Launches of draws (N, 2) [m], limited by the arm, and where else they may land.

    Args:
        error: Standard deviation of the draws along each axis [m]; None: of commanded ones.
    """
    error = found.settings.trials.actuation_error if error is None else error

    def launcher(draws: np.ndarray, parameters: Parameters = found.parameters) -> Launches:
        return found.launches(draws, parameters.values)

    launches = limited(launcher(draws), found.settings.setup.max_force)
    return launches, landing_spread(launcher, draws, found.sampled, error)


def aims_of(found: Identification, target: np.ndarray, draw: np.ndarray) -> Aims:
    """Launch draws (T, 2) [m] at targets (T,) [m], with the best θ and with samples of it."""
    launches, spread = predicted(found, draw)
    return Aims(
        target=target,
        draw=draw,
        landing=launches.landing_y,
        interval=np.where(np.isnan(launches.landing_y)[:, None], np.nan, spread.interval),
        hold_force=launches.hold_force,
        failure=launches.failure,
        stretch=stretches(found, draw),
        spread=spread,
    )


def checked(found: Identification, rows: Sequence[LaunchRow]) -> pd.DataFrame:
    """Measured launches that are to check predictions, beside these: columns LAUNCHED."""
    tables = []
    for row in rows:
        if row.use == CHECK and row.landing is not None:
            draw = np.array([row.draw])
            launches, spread = predicted(found, draw, row.error)
            ends = np.where(np.isnan(launches.landing_y[0]), np.nan, spread.interval[0])
            cells = "measured", row.landing, launches.landing_y[0], *ends
            tables.append((*cells, stretches(found, draw)[0]))
    table = pd.DataFrame(tables, columns=list(LAUNCHED))
    table = table.astype(dict.fromkeys(LAUNCHED[1:], float))
    return table.loc[table.predicted_y.notna()]
