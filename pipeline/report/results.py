"""Everything that the report shows, read once; an expected input that is missing is refused."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from pipeline.episode.episode import Episode
from pipeline.landing.landing_map import LandingMap
from pipeline.landing.stored import ROBUST, Stored
from pipeline.launches.measured import file_of, named
from pipeline.params import pairs
from pipeline.report.floors import load_floor
from pipeline.search.regions import Region, load_regions
from pipeline.sling.theta import load_theta
from stages.start import expect, expect_from


@dataclass(frozen=True)
class Result:
    """What one method made of one band.

    Attributes:
        theta: The θ file: "theta", "loss", "rollouts", "confidence", ...
        history: Every evaluated θ, the exploration's rows before the refinement's.
        regions: Where the refinement began; none for a search of one phase.
        axes: Names of the regions' axes in the unit cube.
        posterior: "names", "samples", "profiles", "mean"; None where θ has no confidence.
        card: The policy's card; `robust_card` that of the second policy, None without one.
        training: One row an iteration of the policy's training.
        landing_map: Simulated launches over the box of draws.
        trials: One row a launch (pipeline/launches/trials.py), those of the robust policy apart.
        robust_trials: Its launches; no rows where the method has none.
    """

    band: str
    method: str
    theta: dict
    history: pd.DataFrame
    regions: list[Region]
    axes: list[str]
    posterior: dict | None
    card: dict
    robust_card: dict | None
    training: pd.DataFrame
    landing_map: LandingMap
    trials: pd.DataFrame
    robust_trials: pd.DataFrame

    @property
    def confidence(self) -> dict:
        """Intervals of the θ file by kind; empty where it has none."""
        return self.theta.get("confidence") or {}


@dataclass(frozen=True)
class Results:
    """All that ran: `episodes` by band, `methods` by band and then method, in the order of run.

    `floors` is the actuation floor of each band that the rig launches (pipeline/oracle/floor.py);
    `unused` counts a band's measured launches of methods that do not run on it, where there are.
    """

    episodes: dict[str, Episode]
    methods: dict[str, dict[str, Result]]
    floors: dict[str, dict]
    unused: dict[str, int] = field(default_factory=dict)

    @property
    def trials(self) -> pd.DataFrame:
        return pd.concat([one.trials for one in self], ignore_index=True)

    def __iter__(self):
        """Every result, band by band."""
        for methods in self.methods.values():
            yield from methods.values()


def gather(params, root: str | Path = ".") -> Results:
    """Read the outputs of every band and method of params.run. Raises UserError."""
    data = Path(root) / "data"
    episodes, methods = {}, {band: {} for band in params.run.bands}
    for band in methods:
        expect(data / "episodes" / band / "signals.parquet", f"episode@{band}")
        episodes[band] = Episode.load(data / "episodes" / band)
    for band, method in pairs(params.run):
        methods[band][method] = _result(params.run, data, band, method)
    floors = {
        band: load_floor(expect(data / "floor" / f"{band}.json", f"floor@{band}"))
        for band in params.run.rig
    }
    unused = {band: _unused(params, data, band, methods[band]) for band in methods}
    return Results(episodes, methods, floors, {band: n for band, n in unused.items() if n})


def _unused(params, data: Path, band: str, methods: Collection[str]) -> int:
    """How many measured launches name a method that does not run on the band."""
    path = file_of(data / "trials" / "measured", band, params.bands)
    launches = named(path) if path else {}
    return sum(n for method, n in launches.items() if method not in ("", *methods))


def _result(run, data: Path, band: str, method: str) -> Result:
    def path(step: str, name: str, stage: str) -> Path:
        return expect_from(run, stage, band, method, data / step / band / name)

    policy = f"{method}/"
    history = [
        pd.read_parquet(path(step, f"{method}.parquet", step)) for step in ("history", "refined")
    ]
    clusters = path("clusters", f"{method}.json", "clusters")
    theta = load_theta(path("theta", f"{method}.json", "theta"), band)
    posterior = None
    if theta.get("confidence"):
        posterior = json.loads(path("confidence", f"{method}.json", "theta").read_text("utf-8"))
    trials = pd.read_parquet(path("trials", f"{method}.parquet", "trials"))
    robust = trials.policy == ROBUST
    stored = Stored(run, band, method, data.parent)
    return Result(
        band=band,
        method=method,
        theta=theta,
        history=pd.concat([part for part in history if len(part)], ignore_index=True),
        regions=load_regions(clusters),
        axes=json.loads(clusters.read_text("utf-8"))["names"],
        posterior=posterior,
        card=stored.card(),
        robust_card=stored.card(ROBUST) if ROBUST in stored.kinds() else None,
        training=pd.read_parquet(path("policies", policy + "training.parquet", "policy")),
        landing_map=LandingMap.load(path("policies", policy + "map.parquet", "policy")),
        trials=trials[~robust].reset_index(drop=True),
        robust_trials=trials[robust].reset_index(drop=True),
    )
