"""Everything that the report shows, read once; an expected input that is missing is refused.

Launches of all pairs are one DataFrame, as `sling2sim2real/launching/trials/trials.py` has their
columns, and beside: `name` of the recording, `source` (virtual, measured or predicted), `miss`
= landing - target [m] of launches that count, `off` = predicted / landing - 1, and `inside`: the
draw stretches the band no further than the recording did.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.layout import Layout
from pipeline.params import Params
from pipeline.params.run import Pair
from pipeline.report.paper import METHOD
from sling2sim2real.base.files import NotMade, made
from sling2sim2real.base.launches_file import CHECK, read_launches
from sling2sim2real.base.schema import JsonRecord, read_json
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.drawing.styles import Styles, styles
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.identification.searches.regions import Region, load_regions
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
    """What one method made of a band's first recording.

    Attributes:
        theta: The θ file: "theta", "loss", "rollouts", "confidence", ...
        evaluations: Every evaluated θ, the exploration's rows before the refinement's.
        regions: Where the refinement began; none for a search of one phase.
        axes: Names of the regions' axes in the unit cube.
        policy: Its files, which tell draws of targets; `card` is what they say of it.
    """

    pair: Pair
    theta: dict
    evaluations: pd.DataFrame
    regions: list[Region]
    axes: list[str]
    policy: Stored
    card: dict

    @property
    def band(self) -> str:
        return self.pair.band

    @property
    def method(self) -> str:
        return self.pair.method

    @property
    def confidence(self) -> dict:
        """What the θ file says of its intervals; empty where it has none."""
        return self.theta.get("confidence") or {}

    @property
    def rollouts(self) -> int:
        """How many the search spent."""
        return self.theta.get("rollouts", len(self.evaluations))

    @property
    def printed_loss(self) -> float:
        """The paper's loss of the calibrated simulator, whatever the method minimised."""
        return float(sum(self.theta.get("loss", {}).get(term, np.nan) for term in PRINTED))


@dataclass(frozen=True)
class Run:
    """All that ran.

    Attributes:
        episodes: First recording of each band.
        results: By band and then method, in params.yaml's order.
        trials: Launches of all pairs, those of further recordings by the main method alone.
        floors: The actuation floor of each band of the rig (rig/oracle/floor.py).
        unused: Of a band, launches to check methods that do not run on it.
        styles: Of each method that ran.
    """

    params: Params
    layout: Layout
    episodes: dict[str, Episode]
    results: dict[str, dict[str, Result]]
    trials: pd.DataFrame
    floors: dict[str, dict]
    unused: dict[str, int]
    styles: Styles

    def __iter__(self) -> Iterator[Result]:
        """Every result, band by band."""
        for of_band in self.results.values():
            yield from of_band.values()

    @property
    def main(self) -> str:
        """The method that the report is about first: that of the cards."""
        return self.params.run.main

    @property
    def shared(self) -> list[str]:
        """Methods that run on every band."""
        return [m for m in self.styles if all(m in of_band for of_band in self.results.values())]

    @property
    def references(self) -> tuple[str, ...]:
        """What others are compared with: the main method, and the paper's where it ran too."""
        return tuple(dict.fromkeys((self.main, *({METHOD} & {*self.shared}))))

    @property
    def launched(self) -> pd.DataFrame:
        """Launches that landed or failed to, of the bands' first recordings."""
        names = {first.key for first in self.params.run.first.values()}
        return self.trials.loc[(self.trials.source != "predicted") & self.trials.name.isin(names)]

    @property
    def least(self) -> dict[str, float]:
        """Mean error of the actuation floor by band [m], where the oracle's launches land."""
        means = {band: floor["mean_error_m"] for band, floor in self.floors.items()}
        return {band: mean for band, mean in means.items() if mean}


def gather(params: Params, root: str | Path = ".") -> Run:
    """Read the outputs of everything in params.run. Raises UserError."""
    layout, run = Layout(Path(root)), params.run
    episodes = {band: Episode.load(layout.episode(first)) for band, first in run.first.items()}
    results, trials = {}, []
    for name, recording in run.recordings.items():
        pairs = {m: run.pairs[key] for m in params.methods if (key := f"{name}-{m}") in run.pairs}
        if name == run.first[recording.band].key:
            results[recording.band] = {m: _result(params, layout, pairs[m]) for m in pairs}
        else:
            pairs = {run.main: pairs[run.main]}
        trials += [
            pd.read_parquet(made(layout.trials(p))).assign(name=name) for p in pairs.values()
        ]
    floors = {
        band: read_json(layout.floor(band), Floor).model_dump()
        for band in run.floors
        if band in results
    }
    unused = {band: _unused(layout, band, {*of_band}) for band, of_band in results.items()}
    named = styles(dict.fromkeys(method for of_band in results.values() for method in of_band))
    table = with_errors(pd.concat(trials, ignore_index=True))
    return Run(params, layout, episodes, results, table, floors, unused, named)


def with_errors(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials with the columns that this report adds. A landing outside the target area fails."""
    counts = trials.failure.isna() & trials.landing_y.between(*TARGET_AREA)
    return trials.rename(columns={"kind": "source"}).assign(
        counts=counts,
        miss=(trials.landing_y - trials.target).where(counts),
        off=trials.predicted_y / trials.landing_y - 1,
        inside=trials.stretch <= trials.recorded_stretch,
    )


def _unused(layout: Layout, band: str, methods: set[str]) -> int:
    launches = read_launches(layout.launches(band))
    return sum(launch.use == CHECK and launch.method not in {"", *methods} for launch in launches)


def _result(params: Params, layout: Layout, pair: Pair) -> Result:
    evaluations = pd.read_parquet(made(layout.evaluations(pair)))
    clusters = layout.clusters(pair)
    clustered = params.methods[pair.method].search == "multistart"
    regions, axes = load_regions(clusters) if clustered else ([], [])
    if missing := [name for name in axes if f"unit_{name}" not in evaluations]:
        raise NotMade(clusters, f"names: {missing[0]} was not searched")
    policy = Stored(layout.policy(pair))
    return Result(
        pair=pair,
        theta=load_theta(layout.theta(pair), pair.band),
        evaluations=evaluations,
        regions=regions,
        axes=axes,
        policy=policy,
        card=policy.card(),
    )
