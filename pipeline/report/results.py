"""Everything that the report shows, read once; an expected input that is missing is refused."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from pipeline.episode import Episode
from pipeline.policy.landing_map import LandingMap
from pipeline.stage import expect
from pipeline.theta import load_theta


@dataclass(frozen=True)
class Result:
    """What one method made of one band.

    Attributes:
        theta: The θ file: "theta", "loss", "rollouts", ...
        history: Every evaluated θ, the exploration's rows before the refinement's.
        card: The policy's card.
        training: One row an iteration of the policy's training.
        landing_map: Simulated launches over the box of draws.
        trials: One row a launch (pipeline/policy/trials.py).
    """

    band: str
    method: str
    theta: dict
    history: pd.DataFrame
    card: dict
    training: pd.DataFrame
    landing_map: LandingMap
    trials: pd.DataFrame


@dataclass(frozen=True)
class Results:
    """All that ran: `episodes` by band, `methods` by band and then method, in the order of run."""

    episodes: dict[str, Episode]
    methods: dict[str, dict[str, Result]]

    @property
    def trials(self) -> pd.DataFrame:
        return pd.concat(
            [one.trials for by_method in self.methods.values() for one in by_method.values()],
            ignore_index=True,
        )


def gather(params, root: str | Path = ".") -> Results:
    """Read the outputs of every band and method of params.run. Raises UserError."""
    data = Path(root) / "data"
    episodes, methods = {}, {}
    for band in params.run.bands:
        expect(data / "episodes" / band / "signals.parquet", f"episode@{band}")
        episodes[band] = Episode.load(data / "episodes" / band)
        methods[band] = {name: _result(data, band, name) for name in params.run.methods}
    return Results(episodes, methods)


def _result(data: Path, band: str, method: str) -> Result:
    def path(step: str, name: str, stage: str) -> Path:
        return expect(data / step / band / name, f"{stage}@{band}-{method}")

    policy = f"{method}/"
    history = [
        pd.read_parquet(path(step, f"{method}.parquet", step)) for step in ("history", "refined")
    ]
    return Result(
        band=band,
        method=method,
        theta=load_theta(path("theta", f"{method}.json", "theta"), band),
        history=pd.concat(history, ignore_index=True),
        card=json.loads(path("policies", policy + "card.json", "policy").read_text("utf-8")),
        training=pd.read_parquet(path("policies", policy + "training.parquet", "policy")),
        landing_map=LandingMap.load(path("policies", policy + "map.parquet", "policy")),
        trials=pd.read_parquet(path("trials", f"{method}.parquet", "trials")),
    )
