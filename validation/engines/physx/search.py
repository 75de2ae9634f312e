"""Identify a band inside PhysX, and see what its theta does in our simulator.

    python -m validation.engines.physx.search band1 [--params FILE] [--landings CSV]

The paper's method with the budget of params.yaml, once with rollouts in PhysX and once with ours:
same episode, mesh of clamps, loss, optimisers and seed. Then each theta* in both engines, and the
launches of both in ours. Writes reports/validation/physx-<band>.json. What was simulated is kept in
.checkpoints/physx/, so that a search that was killed goes on.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.fingerprint import fingerprint
from pipeline.base.layout import Layout
from pipeline.base.progress import Progress
from pipeline.episode.episode import Episode
from pipeline.objective.cache import EvaluationCache
from pipeline.objective.evaluate import Evaluator, simulated
from pipeline.objective.loss import TERMS, EpisodeLoss
from pipeline.objective.session import SOURCES, LoggingEvaluator
from pipeline.objective.space import Space
from pipeline.params import load
from pipeline.search.history import History
from pipeline.search.loop import budget
from pipeline.sling.launch import launch
from pipeline.sling.load import sling_of_method
from validation.benchmarks.methods import complete
from validation.benchmarks.timing import environment
from validation.engines.physx.bands import Engine, release
from validation.engines.physx.rollouts import ITERATIONS, RATE, simulate_with

METHOD = "sling2sim2real"
DEVICE = "cuda:0"
OURS, PHYSX = "ours", "physx"


class Comparison:
    """The same search of one band in both engines."""

    def __init__(self, params, band: str, engine: Engine) -> None:
        self.params, self.band = params, band
        self.episode = Episode.load(Layout().episode(band))
        self.sling = sling_of_method(params, band, METHOD)
        self.space = Space.of_method(params, METHOD)
        self._loss = EpisodeLoss.of(params, METHOD, self.episode, self.sling)
        self._simulate = {OURS: simulated, PHYSX: simulate_with(engine)}

    def evaluator(self, engine: str) -> EvaluationCache:
        """Of points of the unit cube, with what the engine simulated before."""
        evaluate = Evaluator(
            self.episode,
            self.sling,
            self._loss,
            self.space,
            devices=[DEVICE],
            simulate=self._simulate[engine],
        )
        of = fingerprint(
            *SOURCES,
            Path(__file__).parent,
            Layout().episode(self.band) / "signals.parquet",
            Layout().mounting(self.band),
            self.params.model_dump_json(),
        )
        return EvaluationCache(evaluate, Path(".checkpoints/physx", f"{self.band}-{engine}"), of)

    def search(self, engine: str) -> tuple[History, float]:
        """Everything that was evaluated, and the seconds that it took (less what was recalled)."""
        total = sum(budget(self.params.optimizer, self.params.methods[METHOD].search))
        progress = Progress(f"{engine}-{self.band}-{METHOD}", total, "rollouts")
        evaluate, began = self.evaluator(engine), time.perf_counter()
        logged = LoggingEvaluator(evaluate, progress)
        history = complete(self.params, METHOD, self.params.optimizer, logged)
        return history, time.perf_counter() - began

    def losses(self, thetas: np.ndarray) -> dict[str, list[dict]]:
        """Terms of the loss of thetas (N, 5) by engine; None where one failed."""
        unit, found = self.space.to_unit(thetas), {}
        for engine in (OURS, PHYSX):
            done = self.evaluator(engine)(unit)
            found[engine] = [
                {"total": _plain(done.total[i]), "failure": done.failure[i]}
                | {name: _plain(done.terms[name][i]) for name in TERMS}
                for i in range(len(thetas))
            ]
        return found

    def launches(self, thetas: np.ndarray, draws: np.ndarray, measured) -> list[dict]:
        """Where our simulator lands the draws (L, 2) with each theta, and where they landed [m]."""
        landings = np.array(
            [launch(self.sling, np.tile(one, (len(draws), 1)), draws).landing_y for one in thetas]
        )
        rows = []
        for i, draw in enumerate(draws):
            by = dict(zip((OURS, PHYSX), map(_plain, landings[:, i]), strict=True))
            rows.append({"draw_m": draw.tolist(), "landing_by_theta_of_m": by})
            if measured is not None:
                rows[-1]["measured_m"] = float(measured[i])
        return rows


def main() -> None:
    """Search, compare, write. Raises UserError."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("band")
    parser.add_argument("--params", default="params.yaml")
    parser.add_argument("--landings", help="CSV of measured launches of this band")
    asked = parser.parse_args()
    params, version = load(asked.params), release()
    about = environment(DEVICE, f"python -m validation.engines.physx.search {asked.band}")
    if asked.landings:
        table = pd.read_csv(asked.landings)
        draws, measured = table[["draw_y_m", "draw_z_m"]].to_numpy(), table.landing_y_m
    else:
        box = params.setup
        low, high = np.array([box.draw_y, box.draw_z]).T
        draws, measured = low + np.array([[0.25], [0.5], [0.75]]) * (high - low), None
    content = {}
    with Engine() as engine:
        comparison = Comparison(params, asked.band, engine)
        thetas = []
        for name in (OURS, PHYSX):
            history, seconds = comparison.search(name)
            best = history.best()
            thetas.append([best[one] for one in comparison.space.names])
            content[name] = {
                "theta": dict(zip(comparison.space.names, thetas[-1], strict=True)),
                "rollouts": len(history.total),
                "failed": int(np.isinf(history.total).sum()),
                "seconds": seconds,
            }
        losses = comparison.losses(np.array(thetas))
    for i, name in enumerate((OURS, PHYSX)):
        content[name]["loss_in"] = {where: rows[i] for where, rows in losses.items()}
    content |= {
        "band": asked.band,
        "method": METHOD,
        "seed": params.optimizer.seed,
        "settings": {"steps_per_s": RATE, "iterations": ITERATIONS, "tetrahedra": 936},
        "launches_in_our_simulator": comparison.launches(np.array(thetas), draws, measured),
    }
    about["versions"] |= {"ovphysx": version}
    write_json(Path("reports/validation") / f"physx-{asked.band}.json", content | about)


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


if __name__ == "__main__":
    try:
        main()
    except UserError as error:
        sys.exit(f"error: {error}")
