"""Identify a band inside PhysX, and see what its theta does in our simulator.

    python -m validation.engines.physx.search band1 [--params FILE] [--landings CSV]

The paper's method with the budget of params.yaml, once with `engine: physx` and once with ours:
same episode, clamps, loss, optimisers and seed. Then each theta* in both engines, and launches with
both in ours, whose arm gives way. Writes reports/validation/physx-<band>.json; then, into the same
file, launches with both in both engines, where no arm gives way, in PhysX also with finer steps.
What was simulated is kept in .checkpoints, so that a search that was killed goes on. SLING_DEVICE
names the device of ours.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.base.machine import devices
from pipeline.identify.identify import evaluations_of
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.loss import TERMS
from pipeline.identify.objective.session import logging_evaluator
from pipeline.identify.results.mounting import sling_of_method
from pipeline.identify.search.evaluations import Evaluations
from pipeline.identify.search.explore import rollouts_of
from pipeline.params import load
from pipeline.params.identification import OUR_ENGINE
from pipeline.simulator.launch import launch
from pipeline.simulator.model import LaunchSetup
from pipeline.simulator.parameters import Parameters
from validation.engines.physx.bands import Engine, release
from validation.engines.physx.launches import FINE, alike, draws_of, launch_in_physx
from validation.engines.physx.rollouts import ITERATIONS, RATE
from validation.reports import plain, write_report

METHOD = "sling2sim2real"
OURS, PHYSX = "ours", "physx"
ENGINES = {OURS: OUR_ENGINE, PHYSX: "physx"}


def with_engines(params):
    """params.yaml with a method for each of ENGINES: the paper's, simulated there."""
    paper = params.methods[METHOD]
    both = {name: paper.model_copy(update={"engine": engine}) for name, engine in ENGINES.items()}
    return params.model_copy(update={"methods": dict(params.methods.items()) | both})


class Comparison:
    """The same search of one band in both engines."""

    def __init__(self, params, band: str) -> None:
        self.params, self.band = with_engines(params), band
        self.sling = sling_of_method(self.params, band, OURS)
        self.setup = LaunchSetup.of(params.setup, params.sling)
        self.box = SearchBox.of_method(self.params, OURS)

    def search(self, engine: str) -> tuple[Evaluations, float]:
        """Everything that was evaluated, and the seconds that it took (less what was recalled)."""
        optimizer = self.params.optimizer
        total = rollouts_of(self.params, engine) + optimizer.cma_rollouts  # a multistart
        evaluate = logging_evaluator("search", self.band, engine, self.params, total)
        began = time.perf_counter()
        evaluations = evaluations_of(self.params, engine, evaluate)
        return evaluations, time.perf_counter() - began

    def losses(self, thetas: np.ndarray) -> dict[str, list[dict]]:
        """Terms of the loss of thetas (N, 5) by engine; None where one failed."""
        unit, rows = self.box.to_unit(thetas), {}
        for engine in (OURS, PHYSX):
            done = logging_evaluator("losses", self.band, engine, self.params, len(unit))(unit)
            rows[engine] = [
                {"total": done.total[i], "failure": done.failure[i]}
                | {name: done.terms[name][i] for name in TERMS}
                for i in range(len(thetas))
            ]
        return rows

    def launches(self, thetas: np.ndarray, draws: np.ndarray, measured) -> list[dict]:
        """Where our simulator lands the draws (L, 2) with each theta, and where they landed [m]."""
        landings = np.array(
            [
                launch(self.sling, self.setup, parameters, draws).landing_y
                for parameters in (Parameters.of(self.sling.law, theta) for theta in thetas)
            ]
        )
        rows = []
        for i, draw in enumerate(draws):
            by = dict(zip((OURS, PHYSX), landings[:, i], strict=True))
            rows.append({"draw_m": draw.tolist(), "landing_by_theta_of_m": by})
            if measured is not None:
                rows[-1]["measured_m"] = float(measured[i])
        return rows

    def launched(self, where: str, thetas: np.ndarray, draws: np.ndarray, rate: int) -> dict:
        """Launches of the draws (L, 2) with each theta by an engine: lists (L,) by theta.

        Raises UserError, as `Engine`.
        """
        both = self.sling, alike(self.params)
        each, every = np.repeat(thetas, len(draws), axis=0), np.tile(draws, (len(thetas), 1))
        gained = [None] * len(every)
        if where == OURS:
            done = launch(*both, Parameters.of(self.sling.law, each), every)
        else:
            with Engine() as engine:
                pushed = launch_in_physx(engine, *both, each, every, rate=rate)
            done, gained = pushed.launches, pushed.gained
        columns = plain(
            {
                "landing_m": done.landing_y,
                "speed_m_per_s": done.speed,
                "hold_force_n": done.hold_force,
                "energy_gained": gained,
                "failure": done.failure,
            }
        )
        count = len(draws)
        return {
            name: {key: column[i * count : (i + 1) * count] for key, column in columns.items()}
            for i, name in enumerate((OURS, PHYSX))
        }


def side_by_side(done: dict[str, dict], draws: np.ndarray, measured) -> list[dict]:
    """A row for each of the draws (L, 2): what each engine of `done` says with each theta."""
    rows = []
    for i, draw in enumerate(draws.tolist()):
        row = {"draw_m": draw} | ({} if measured is None else {"measured_m": float(measured[i])})
        for where, by_theta in done.items():
            row[f"in_{where}_by_theta_of"] = {
                name: {key: column[i] for key, column in columns.items()}
                for name, columns in by_theta.items()
            }
        rows.append(row)
    return rows


def main() -> None:
    """Search, compare, write. Raises UserError."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("band")
    parser.add_argument("--params", default="params.yaml")
    parser.add_argument("--landings", help="CSV of measured launches of this band")
    requested = parser.parse_args()
    params, version = load(requested.params), release()
    arguments = requested.band + (" --landings CSV" if requested.landings else "")
    options = {"device": devices()[0], "versions": {"ovphysx": version}}
    if requested.landings:
        table = pd.read_csv(requested.landings)
        draws, measured = table[["draw_y_m", "draw_z_m"]].to_numpy(), table.landing_y_m
    else:
        draws, measured = draws_of(params.setup), None
    comparison, content, thetas = Comparison(params, requested.band), {}, []
    for name in (OURS, PHYSX):
        evaluations, seconds = comparison.search(name)
        best = evaluations.best_row()
        thetas.append([best[parameter] for parameter in comparison.box.names])
        content[name] = {
            "theta": dict(zip(comparison.box.names, thetas[-1], strict=True)),
            "rollouts": len(evaluations.total),
            "failed": int(np.isinf(evaluations.total).sum()),
            "seconds": seconds,
        }
    for where, rows in comparison.losses(np.array(thetas)).items():
        for name, row in zip((OURS, PHYSX), rows, strict=True):
            content[name].setdefault("loss_in", {})[where] = row
    content |= {
        "band": requested.band,
        "method": METHOD,
        "seed": params.optimizer.seed,
        "settings": {"steps_per_s": RATE, "iterations": ITERATIONS, "tetrahedra": 936},
        "launches_in_our_simulator": comparison.launches(np.array(thetas), draws, measured),
    }
    path = Path("reports/validation") / f"physx-{requested.band}.json"
    write_report(path, content, arguments, **options)
    done, failures = {}, {}
    for where, rate in ((OURS, RATE), (PHYSX, RATE), (f"{PHYSX}_{FINE}_hz", FINE)):
        try:
            done[where] = comparison.launched(where, np.array(thetas), draws, rate)
        except UserError as error:
            failures[where] = str(error)
        content["launches"] = {
            "arm": "does not give way",
            "failed_engines": failures,
            "draws": side_by_side(done, draws, measured),
        }
        write_report(path, content, arguments, **options)


if __name__ == "__main__":
    errors.run(main)
