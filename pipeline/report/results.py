"""Everything that the report shows, read once; an expected input that is missing is refused."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.layout import Layout
from pipeline.params import Params
from pipeline.params.run import Pair
from sling2sim2real.base.launches_file import CHECK, read_launches
from sling2sim2real.base.layout import NotMade, made
from sling2sim2real.base.schema import JsonRecord, read_json
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.identification.searches.regions import Region, load_regions
from sling2sim2real.launching.surface.landing_map import LandingMap
from sling2sim2real.launching.surface.stored import Stored

PRINTED = ("geom", "force", "work")  # the paper's loss is their sum (docs/method.md)


class FloorOfTarget(JsonRecord):
    mean_error_m: float | None


class Floor(FloorOfTarget):
    """The part of what stages/floor.py wrote that is shown."""

    launches: int
    targets: dict[str, FloorOfTarget]


@dataclass(frozen=True)
class Result:
    """What one method made of one recording.

    Attributes:
        theta: The θ file: "theta", "loss", "rollouts", "confidence", ...
        evaluations: Every evaluated θ, the exploration's rows before the refinement's.
        regions: Where the refinement began; none for a search of one phase.
        axes: Names of the regions' axes in the unit cube.
        card: The policy's card.
        training: One row an iteration of the policy's training.
        landing_map: Simulated launches over the box of draws.
        trials: One row a launch (sling2sim2real/launching/trials/trials.py).
    """

    pair: Pair
    theta: dict
    evaluations: pd.DataFrame
    regions: list[Region]
    axes: list[str]
    card: dict
    training: pd.DataFrame
    landing_map: LandingMap
    trials: pd.DataFrame

    @property
    def band(self) -> str:
        return self.pair.band

    @property
    def method(self) -> str:
        return self.pair.method

    @property
    def confidence(self) -> dict:
        """Intervals of the θ file by kind; empty where it has none."""
        return self.theta.get("confidence") or {}


@dataclass(frozen=True)
class Another:
    """A further recording of a band, by the main method.

    Attributes:
        trials: As of a `Result`.
    """

    band: str
    recording: str
    trials: pd.DataFrame


@dataclass(frozen=True)
class Results:
    """All that ran: `episodes` by band, `methods` by band and then method, in params.yaml's order.

    They are of each band's first recording; `others` are the further ones, by their names. `floors`
    is the actuation floor of each band of the rig (rig/oracle/floor.py); `unused` counts a band's
    launches to check methods that do not run on it, where there are.
    """

    episodes: dict[str, Episode]
    methods: dict[str, dict[str, Result]]
    floors: dict[str, dict]
    unused: dict[str, int] = field(default_factory=dict)
    others: dict[str, Another] = field(default_factory=dict)

    @property
    def shared(self) -> list[str]:
        """Methods that run on every band."""
        methods = dict.fromkeys(result.method for result in self)
        return [m for m in methods if all(m in of_band for of_band in self.methods.values())]

    @property
    def least(self) -> dict[str, float]:
        """Mean error of the actuation floor by band [m], where the oracle's launches land."""
        means = {band: floor["mean_error_m"] for band, floor in self.floors.items()}
        return {band: mean for band, mean in means.items() if mean}

    @property
    def trials(self) -> pd.DataFrame:
        return pd.concat([result.trials for result in self], ignore_index=True)

    def __iter__(self):
        """Every result, band by band."""
        for methods in self.methods.values():
            yield from methods.values()


def gather(params: Params, root: str | Path = ".") -> Results:
    """Read the outputs of every band and method of params.run. Raises UserError."""
    layout, run = Layout(Path(root)), params.run
    episodes = {band: Episode.load(layout.episode(first)) for band, first in run.first.items()}
    methods = {
        band: {
            method: _result(params, layout, run.pairs[key])
            for method in params.methods
            if (key := f"{first.key}-{method}") in run.pairs
        }
        for band, first in run.first.items()
    }
    floors = {band: load_floor(layout.floor(band)) for band in run.floors if band in methods}
    unused = {band: _unused(layout, band, methods[band]) for band in methods}
    others = {
        key: Another(
            recording.band,
            recording.recording,
            pd.read_parquet(made(layout.trials(run.pairs[f"{key}-{run.main}"]))),
        )
        for key, recording in run.recordings.items()
        if recording not in run.first.values()
    }
    return Results(episodes, methods, floors, {band: n for band, n in unused.items() if n}, others)


def _unused(layout: Layout, band: str, methods: Collection[str]) -> int:
    """How many launches check a method that does not run on the band."""
    launches = read_launches(layout.launches(band))
    return sum(launch.use == CHECK and launch.method not in ("", *methods) for launch in launches)


def _result(params: Params, layout: Layout, pair: Pair) -> Result:
    evaluations = pd.read_parquet(made(layout.evaluations(pair)))
    clusters = layout.clusters(pair)
    clustered = params.methods[pair.method].search == "multistart"
    regions, axes = load_regions(clusters) if clustered else ([], [])
    if missing := [name for name in axes if f"unit_{name}" not in evaluations]:
        raise NotMade(clusters, f"names: {missing[0]} was not searched")
    theta = load_theta(layout.theta(pair), pair.band)
    policy = layout.policy(pair)
    return Result(
        pair=pair,
        theta=theta,
        evaluations=evaluations,
        regions=regions,
        axes=axes,
        card=Stored(policy).card(),
        training=pd.read_parquet(made(policy / "training.parquet")),
        landing_map=LandingMap.load(made(policy / "map.parquet")),
        trials=pd.read_parquet(made(layout.trials(pair))),
    )


def load_floor(path: Path) -> dict:
    """Read what stages/floor.py wrote. Raises NotMade."""
    return read_json(path, Floor).model_dump()


def printed(evaluations: pd.DataFrame) -> np.ndarray:
    """The paper's printed loss of every row, shape (N,), whatever the method minimised."""
    total = evaluations[list(PRINTED)].sum(axis=1, skipna=False).to_numpy(float)
    return np.where(np.isfinite(total), total, np.inf)


def best_so_far(evaluations: pd.DataFrame) -> np.ndarray:
    """Row of the least total of the method's own loss among the rows so far, shape (N,)."""
    total = evaluations.total.to_numpy(float)
    total = np.where(np.isfinite(total), total, np.inf)
    better = np.append(True, total[1:] < np.minimum.accumulate(total)[:-1])
    return np.maximum.accumulate(np.where(better, np.arange(len(total)), 0))


def has_another_loss(weights: dict[str, float]) -> bool:
    """Whether a method's weights are others than the printed loss's."""
    return any(weight != (name in PRINTED) for name, weight in weights.items())
