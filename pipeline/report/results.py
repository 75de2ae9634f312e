"""Everything that the report shows, read once; an expected input that is missing is refused."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.params import Params
from sling2sim2real.base.layout import Layout, NotMade, made
from sling2sim2real.base.schema import JsonRecord, read_json
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.identification.searches.regions import Region, load_regions
from sling2sim2real.launching.surface.landing_map import LandingMap
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials.measured import load_scores

PRINTED = ("geom", "force", "work")  # the paper's loss is their sum (docs/method.md)


class FloorOfTarget(JsonRecord):
    mean_error_m: float | None


class Floor(FloorOfTarget):
    """The part of what stages/floor.py wrote that is shown."""

    launches: int
    targets: dict[str, FloorOfTarget]


@dataclass(frozen=True)
class Result:
    """What one method made of one band.

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

    band: str
    method: str
    theta: dict
    evaluations: pd.DataFrame
    regions: list[Region]
    axes: list[str]
    card: dict
    training: pd.DataFrame
    landing_map: LandingMap
    trials: pd.DataFrame

    @property
    def confidence(self) -> dict:
        """Intervals of the θ file by kind; empty where it has none."""
        return self.theta.get("confidence") or {}


@dataclass(frozen=True)
class InformativePull:
    """Another recording of a band of the rig, by the informative pull (`run.dips`).

    Attributes:
        band: The one of `run.bands` whose name its own begins with, or itself.
        trials: As of a `Result`, by the first method.
    """

    band: str
    trials: pd.DataFrame


@dataclass(frozen=True)
class Results:
    """All that ran: `episodes` by band, `methods` by band and then method, in the order of run.

    `floors` is the actuation floor of each band that the rig launches (rig/oracle/floor.py);
    `unused` counts a band's measured launches of methods that do not run on it, where there are.
    """

    episodes: dict[str, Episode]
    methods: dict[str, dict[str, Result]]
    floors: dict[str, dict]
    unused: dict[str, int] = field(default_factory=dict)
    dips: dict[str, InformativePull] = field(default_factory=dict)

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
    layout = Layout(Path(root))
    episodes = {band: Episode.load(layout.episode(band)) for band in params.run.bands}
    methods = {}
    for band in params.run.bands:
        ablations = params.run.ablations.methods if band in params.run.ablations.bands else ()
        ran = dict.fromkeys([*params.run.methods, *ablations])
        methods[band] = {method: _result(params, layout, band, method) for method in ran}
    floors = {band: load_floor(layout.floor(band)) for band in params.run.rig}
    unused = {band: _unused(layout, band, methods[band]) for band in methods}
    dips = {
        name: InformativePull(
            next((listed for listed in params.run.bands if name.startswith(f"{listed}_")), name),
            pd.read_parquet(made(layout.trials(name, params.run.methods[0]))),
        )
        for name in params.run.dips
    }
    return Results(episodes, methods, floors, {band: n for band, n in unused.items() if n}, dips)


def _unused(layout: Layout, band: str, methods: Collection[str]) -> int:
    """How many measured launches name a method that does not run on the band."""
    return sum(score.method not in ("", *methods) for score in load_scores(layout.scores(band)))


def _result(params: Params, layout: Layout, band: str, method: str) -> Result:
    evaluations = pd.read_parquet(made(layout.evaluations(band, method)))
    clusters = layout.clusters(band, method)
    clustered = params.methods[method].search == "multistart"
    regions, axes = load_regions(clusters) if clustered else ([], [])
    if missing := [name for name in axes if f"unit_{name}" not in evaluations]:
        raise NotMade(clusters, f"names: {missing[0]} was not searched")
    theta = load_theta(layout.theta(band, method), band)
    stored, policy = Stored(band, method, layout.root), layout.policy(band, method)
    return Result(
        band=band,
        method=method,
        theta=theta,
        evaluations=evaluations,
        regions=regions,
        axes=axes,
        card=stored.card(),
        training=pd.read_parquet(made(policy / "training.parquet")),
        landing_map=LandingMap.load(made(policy / "map.parquet")),
        trials=pd.read_parquet(made(layout.trials(band, method))),
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
