"""What each way to train a policy as the paper prints it changes in the landing.

    python -m validation.campaigns.policy_as_printed --bands band1 band2

A policy of each band is trained in the simulator of one θ file (data/theta/<band>/<method>.json):
with the settings of params.yaml, with each of the paper's alone, and with all of them. Its draws
are launched in the same simulator, so nothing but the training differs. Results lie as lines of
results.jsonl in --work: a run that was killed goes on from there.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.base.code import ROOT, digest
from pipeline.base.errors import UserError
from pipeline.base.fingerprint import fingerprint
from pipeline.base.progress import Progress
from pipeline.identify.results.theta import load_theta
from pipeline.launching.surface.landing_map import LandingMap
from pipeline.launching.surface.simulated import SimulatedLandings
from pipeline.launching.surface.simulator import simulator
from pipeline.params import Params, expect_known, load
from pipeline.params.launches import PolicyParams
from pipeline.policy.check import check
from pipeline.policy.environment import projectile_start
from pipeline.policy.train import train
from validation.benchmarks.timing import timed
from validation.campaigns import runner
from validation.campaigns.runner import PAPER, ResultLines
from validation.paired import mean_interval
from validation.reports import plain, write_report

WORK = Path("data/policy_as_printed")
REPORT = Path("reports/validation/policy-as-printed.json")
USUAL = {"landings": "map", "exploration": "scheduled", "state": "target"}
PRINTED = {"landings": "simulated", "exploration": "learned", "state": "projectile_target"}
SWITCHES = {"usual": {}, **{name: {name: PRINTED[name]} for name in PRINTED}, "all": PRINTED}
TRAINING = "pipeline/launching/surface", "pipeline/policy", "pipeline/simulator"  # a result's code
SEEDS = 11, 12, 13  # that took part in no choice


@dataclass(frozen=True)
class Lesson:
    """One training: of a band, with a switch turned, from a seed."""

    band: str
    switch: str
    seed: int

    def settings(self, params: Params) -> PolicyParams:
        """`policy` of params.yaml, with the switches as this has them."""
        changes = USUAL | SWITCHES[self.switch] | {"seed": self.seed}
        return params.policy.model_copy(update=changes)


def taught(lesson: Lesson, params: Params, theta: dict, progress: Progress | None) -> dict:
    """How a policy hits that is trained so, and what the training took."""
    settings, setup = lesson.settings(params), params.setup
    launcher = simulator(params, lesson.band, theta)
    box = {"draw_y": setup.draw_y, "draw_z": setup.draw_z, "max_force": setup.max_force}
    surface = LandingMap.simulate(launcher, **box, size=settings.map_size, checks=0).surface
    if settings.landings == "simulated":
        surface = SimulatedLandings(launcher, surface)
    seen = settings.state == "projectile_target"
    start = projectile_start(setup, params.bands[lesson.band]) if seen else None
    trained, cpu, wall = timed(lambda: train(surface, settings, progress, projectile=start))
    checked = check(trained.policy, launcher, params)
    targets = np.array(params.trials.targets)
    launched = launcher(trained.policy.draws(targets))
    fails = [
        bool(reason) or not force <= setup.max_force
        for reason, force in zip(launched.failure, launched.hold_force, strict=True)
    ]
    return {
        "error_m": np.where(fails, np.nan, np.abs(launched.landing_y - targets)).tolist(),
        "range_mean_error_m": checked.mean_error,
        "range_failures": checked.failures,
        "iteration": trained.iteration,
        "last_error_m": trained.curve["mean_error"][-1],
        "std": trained.curve["std"][-1],
        "cpu_s": cpu,
        "wall_s": wall,
    }


def result(lesson: Lesson, params: Params, work: Path, method: str) -> dict:
    """The one in `work`; trained where it is missing, or of another θ, settings or code."""
    theta = load_theta(Path("data/theta", lesson.band, f"{method}.json"), lesson.band)
    inputs = theta, lesson.settings(params).model_dump(), params.setup.model_dump()
    code = [digest(ROOT / part) for part in TRAINING]
    stamp = fingerprint(json.dumps([inputs, params.trials.targets, code], sort_keys=True))
    lines = ResultLines(work / "results.jsonl")
    retained = lines.of(Lesson).get(lesson, {})
    if retained.get("stamp") != stamp:
        name = f"{lesson.band}-{lesson.switch}-{lesson.seed}"
        progress = Progress(name, params.policy.iterations, "iterations", every=10)
        outcome = taught(lesson, params, theta, progress)
        retained = plain({"stamp": stamp, **vars(lesson), **outcome})
        lines.add(retained)
    return {key: value for key, value in retained.items() if key != "stamp"}


def summary(results: list[dict]) -> dict:
    """Means of |y - g| in cm by band and switch, over seeds, each of the mean over the targets."""
    figures: dict[str, dict] = {}
    for row in results:
        figures.setdefault(row["band"], {}).setdefault(row["switch"], []).append(row)
    return {
        band: {switch: _of_seeds(rows) for switch, rows in switches.items()}
        for band, switches in figures.items()
    }


def _of_seeds(rows: list[dict]) -> dict:
    errors_cm, range_cm, last_cm = (
        100 * np.array([row[name] for row in rows], float)  # null becomes NaN
        for name in ("error_m", "range_mean_error_m", "last_error_m")
    )
    return {
        "miss_cm": mean_interval(errors_cm.mean(axis=1)),
        "miss_cm_each": plain(errors_cm),  # a row for each seed
        "range_miss_cm": mean_interval(range_cm),
        "range_failures": sum(sum(row["range_failures"].values()) for row in rows),
        "last_miss_cm": mean_interval(last_cm),
        "std": [row["std"] for row in rows],
        "wall_s": mean_interval(np.array([row["wall_s"] for row in rows])),
    }


def main() -> None:
    params = load()
    parser = runner.parser(__doc__, REPORT, WORK, many=False)
    parser.add_argument("--bands", nargs="+", default=list(params.run.bands))
    parser.add_argument("--method", default=PAPER, help=f"whose θ (default: {PAPER})")
    parser.add_argument("--seeds", nargs="+", type=int, default=SEEDS)
    args = parser.parse_args()
    if min(args.seeds) < 1:
        raise UserError("--seeds: from 1 on")
    expect_known(params, "method", args.method)
    for band in args.bands:
        expect_known(params, "band", band)
    lessons = [
        Lesson(band, switch, seed)
        for seed in args.seeds
        for switch in SWITCHES
        for band in args.bands
    ]
    results = []
    for lesson in lessons:
        results.append(result(lesson, params, args.work, args.method))
        report(args, params, results, len(lessons))


def report(args: argparse.Namespace, params: Params, results: list[dict], wanted: int) -> None:
    """Write what there is."""
    command = f"--bands {' '.join(args.bands)} --method {args.method}"
    content = {
        "kind": "virtual",
        "asked": "What each way to train as the paper prints it changes in |y - g| of the policy's"
        " launches in the simulator that it was trained in; every other setting as in params.yaml.",
        "settings": {
            "targets_m": list(params.trials.targets),
            "seeds": list(args.seeds),
            "switches": {name: USUAL | changed for name, changed in SWITCHES.items()},
            "policy": params.policy.model_dump(mode="json"),
            "theta_of": args.method,
            "miss_cm": "mean over the targets, then over seeds; range_miss_cm: over 256 targets of"
            " policy.targets; last_miss_cm: the same for the last network, not the best one",
        },
        "trainings": wanted,
        "done": len(results),
        "figures": summary(results),
        "results": results,
    }
    write_report(args.report, content, f"{command} --seeds {' '.join(map(str, args.seeds))}")
    last = results[-1]
    line = f"{last['band']} {last['switch']} {last['seed']}: {last['error_m']}"
    print(f"{len(results)} of {wanted}, {line}", flush=True)


if __name__ == "__main__":
    errors.run(main)
