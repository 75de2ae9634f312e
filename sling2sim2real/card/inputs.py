"""All that a band's card is made from, read and launched once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from sling2sim2real.base.layout import made
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import load_samples, load_theta, parameters_of
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials.spread import Spread, landing_spread
from sling2sim2real.launching.trials.stretch import recorded_stretch, stretch_of
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.launch import Launches, limited
from sling2sim2real.simulator.parameters import Parameters


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


@dataclass(frozen=True)
class CardFiles:
    """What a card is called, and where its inputs lie.

    Attributes:
        raw: Folder of the recording's files.
        episodes: Folder of its episodes.
        clamps, theta, confidence, trials: Files.
        policy: Folder of a policy.
    """

    name: str
    raw: Path
    episodes: Path
    clamps: Path
    theta: Path
    confidence: Path
    policy: Path
    trials: Path


@dataclass(frozen=True)
class CardInputs:
    """Inputs of the card of one band by one method.

    Attributes:
        episodes: Of all its pulls; pictures show the first.
        recordings: Names of the files that they are of.
        theta: The θ file; `confidence` of it is empty where the method tells none.
        samples: Of θ; None where the method tells none.
        policy: Its card, as far as it is read.
        trials: One row a launch (sling2sim2real/launching/trials/trials.py).
        recorded_stretch: The largest of all pulls.
    """

    params: Settings
    band: str
    method: str
    files: CardFiles
    episodes: list[Episode]
    theta: dict
    samples: Parameters | None
    policy: dict
    trials: pd.DataFrame
    aims: Aims
    recorded_stretch: float

    @property
    def episode(self) -> Episode:
        return self.episodes[0]

    @property
    def confidence(self) -> dict:
        return self.theta.get("confidence") or {}

    @property
    def launches(self) -> int:
        """Number of launches that are evidence."""
        return len(self.confidence.get("launches", []))

    @property
    def recordings(self) -> list[str]:
        return list(dict.fromkeys(recorded.metadata["input"]["file"] for recorded in self.episodes))

    @property
    def launched(self) -> pd.DataFrame:
        """Launches that landed somewhere, measured or virtual, beside what was predicted."""
        return self.trials.loc[self.trials.landing_y.notna() & self.trials.predicted_y.notna()]


def card_inputs(params: Settings, band: str, method: str, files: CardFiles) -> CardInputs:
    """Read and launch. Raises UserError where an input is missing."""
    band_params = params.bands[band]
    theta = load_theta(files.theta, band)
    samples = load_samples(files.confidence, parameters_of(theta))
    stored = Stored(files.policy)
    episodes = Episode.load_all(files.episodes)
    stretch = partial(
        stretch_of, fork_width=params.setup.fork_width, rest_length=band_params.rest_length
    )
    launcher = simulator(params, band, theta, files.clamps)
    target = np.array(params.trials.targets, float)
    return CardInputs(
        params=params,
        band=band,
        method=method,
        files=files,
        episodes=episodes,
        theta=theta,
        samples=samples,
        policy=stored.card(),
        trials=pd.read_parquet(made(files.trials)),
        aims=aims(launcher, target, stored.draws(target), samples, stretch, params),
        recorded_stretch=recorded_stretch(
            episodes, params.setup.fork_width, band_params.rest_length
        ),
    )


def aims(
    launcher: Callable[..., Launches],
    target: np.ndarray,
    draw: np.ndarray,
    samples: Parameters | None,
    stretch: Callable[[np.ndarray], np.ndarray],
    params: Settings,
) -> Aims:
    """Launch draws (T, 2) at targets (T,), with the best θ and with samples of it.

    Args:
        launcher: As `landing_spread` takes it.
        stretch: Of the band held at points (N, 3).
        params: The whole of params.yaml.
    """
    launches = limited(launcher(draw), params.setup.max_force)
    spread = landing_spread(launcher, draw, samples, params.trials.actuation_error)
    interval = np.where(np.isnan(launches.landing_y)[:, None], np.nan, spread.interval)
    return Aims(
        target=target,
        draw=draw,
        landing=launches.landing_y,
        interval=interval,
        hold_force=launches.hold_force,
        failure=launches.failure,
        stretch=stretch(np.insert(draw, 0, 0, axis=1)),
        spread=spread,
    )
