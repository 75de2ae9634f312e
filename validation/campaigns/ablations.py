"""Ablations and baselines on new recordings of the virtual rig, with error bars.

    python -m validation.campaigns.ablations --preset large --recordings 3 --seeds 3

Recordings have rig seeds from 1001 on, which took part in no choice. Every method identifies each
with one search seed, and the first of each band with five. What it found is aimed at the targets of
the trials, as a perfect policy would, and launched on the rig without errors: the distance from the
target is what the identification (and the law) costs. Results are lines of results.jsonl in --work:
a run that was killed goes on from there.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from pipeline.params import Params, load
from rig.physics.launch import launch
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import processor
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.settings import expect_known
from sling2sim2real.settings.identification import MethodParams
from sling2sim2real.simulator.rubber import NEO_HOOKEAN
from validation.campaigns import runner
from validation.campaigns.rig_scores import aimed, recorded, sling_of
from validation.campaigns.runner import PAPER
from validation.campaigns.variants import rollouts_of_search, with_preset, with_variants
from validation.density import calibrated_by
from validation.paired import LEVEL, compared, mean_interval
from validation.projects import with_section
from validation.reports import row, write_report

WORK = Path("data/ablations")
REPORT = Path("reports/validation/ablations-large.json")
FIRST, SEEDS = 1001, 5  # rig seed of the first recording; search seeds on it


@dataclass(frozen=True)
class Job:
    """One identification: by a method, of a band's recording, with a seed of the search."""

    band: str
    recording: int
    method: str
    seed: int


def jobs_of(
    bands: Sequence[str], methods: Sequence[str], recordings: int, seeds: int, first: int = FIRST
) -> list[Job]:
    """Every identification, first one of each recording."""
    singles = [
        Job(band, first + number, method, 1)
        for number in range(recordings)
        for method in methods
        for band in bands
    ]
    spread = [
        Job(band, first, method, seed)
        for seed in range(2, seeds + 1)
        for method in methods
        for band in bands
    ]
    return singles + spread


def recordings_of(jobs: Sequence[Job]) -> list[tuple[str, int]]:
    """Band and rig seed of each recording that jobs need."""
    return [*dict.fromkeys((job.band, job.recording) for job in jobs)]


def place(work: Path, band: str, recording: int) -> Path:
    return work / "episodes" / band / str(recording)


def record(where: tuple[str, int], work: Path) -> None:
    """Make a recording's episode, with its clamps; what is there stays."""
    band, number = where
    recorded(with_section(load(), "rig", seed=number), band, place(work, band, number))


@cache  # in each process
def _params(method: str, preset: str | None) -> Params:
    return with_preset(with_variants(load()), method, preset)


def aimed_and_launched(job: Job, work: Path, preset: str | None) -> dict:
    """What one identification found of its episode, and where its launches land."""
    params, folder = _params(job.method, preset), place(work, job.band, job.recording)
    optimizer = params.optimizer.model_copy(update={"seed": job.seed})
    params = params.model_copy(update={"optimizer": optimizer})
    episode, sling = (
        Episode.load(folder / "episode"),
        sling_of(params, job.band, job.method, folder),
    )
    start = time.perf_counter()
    outcome, confidence = calibrated_by(params, job.method, sling, [episode])
    seconds, names = time.perf_counter() - start, SearchBox.of_method(params, job.method).names
    draws = aimed(outcome, params, params.trials.targets)
    return {
        "theta": {name: outcome.identified[name] for name in names},
        "loss": confidence.get("loss"),
        "draws_m": draws,
        "error_m": errors_on_the_rig(job.band, params, draws),
        "seconds": seconds,
    }


def errors_on_the_rig(band: str, params: Params, draws: np.ndarray) -> np.ndarray:
    """Landing less target [m] of draws (T, 2), launched on the rig without errors; NaN: none."""
    landing = [
        np.nan if np.isnan(draw).any() else launch(band, params, tuple(draw), None).landing_y
        for draw in draws
    ]
    return np.array(landing) - params.trials.targets


def scores(results: list[dict], name: str) -> np.ndarray:
    """One number a result: the mean miss [cm] over targets that were reached, loss, or E [Pa]."""
    values = {
        "miss_cm": lambda result: 100 * np.nanmean(np.abs(np.array(result["error_m"], float))),
        "loss": lambda result: (result["loss"] or {}).get("total", np.nan),
        "youngs_modulus": lambda result: result["theta"]["youngs_modulus"],
    }[name]
    return np.array([np.nan if lost(result) else values(result) for result in results])


def lost(result: dict) -> bool:
    """Whether no launch of a result landed."""
    return "failed" in result or not np.isfinite(np.array(result["error_m"], float)).any()


def summary(results: list[dict], bands: Sequence[str], methods: Sequence[str]) -> dict:
    """Summarise each band, and all: methods' means, and how each compares with the paper's."""
    by = {(r["band"], r["recording"], r["method"], r["seed"]): r for r in results}

    def picked(band: str, method: str, keys) -> list[dict]:
        """A result each; one that is not there counts as failed, and leaves its pair out."""
        return [by.get((band, rec, method, seed), {"failed": "not run"}) for rec, seed in keys]

    single = sorted({(r["recording"], r["seed"]) for r in results if r["seed"] == 1})
    first = min(r["recording"] for r in results)
    spread = [(first, seed) for seed in sorted({r["seed"] for r in results})]
    figures = {}
    for band in [*bands, "all"]:
        of = bands if band == "all" else [band]
        rows = {m: [r for b in of for r in picked(b, m, single)] for m in methods}
        miss = {method: scores(some, "miss_cm") for method, some in rows.items()}
        figures[band] = {"methods": {}, f"less_{PAPER}": compared(miss, PAPER)}
        for method, some in rows.items():
            run = [result for result in some if result.get("failed") != "not run"]
            signed = [np.nan if lost(result) else mean_of(result["error_m"]) for result in some]
            figures[band]["methods"][method] = {
                "miss_cm": mean_interval(miss[method]),
                "bias_cm": mean_interval(100 * np.array(signed, float)),
                "youngs_modulus": mean_interval(scores(some, "youngs_modulus")),
                "loss": mean_interval(scores(some, "loss")),
                "run": len(run),
                "without_landing": sum(map(lost, run)),
                "targets_out_of_reach": sum(
                    value is None for result in run for value in result.get("error_m", [])
                ),
                "miss_cm_each": miss[method],
                "seconds": mean_of([result.get("seconds") for result in run]),
            }
            if band != "all":
                seeds = scores(picked(band, method, spread), "miss_cm")
                figures[band]["methods"][method]["seeds_on_one_recording"] = mean_interval(seeds)
    return figures


def rank_correlations(results: list[dict], methods: Sequence[str]) -> np.ndarray:
    """Spearman's, of loss and miss over searches of one loss on the same recording; one each.

    Positive: the lower the loss that a search reached, the nearer its launches land.
    """
    groups = {}
    for result in results:
        if result["method"] in methods and result["seed"] == 1 and not lost(result):
            groups.setdefault((result["band"], result["recording"]), []).append(result)
    several = [some for some in groups.values() if len(some) > 2]
    pairs = [(scores(some, "loss"), scores(some, "miss_cm")) for some in several]
    return np.array([spearmanr(*pair).statistic for pair in pairs])


def _of_one_loss(method: MethodParams, params: Params) -> bool:
    """Whether a method minimises what the paper's does, over the same simulations."""
    names = ("weights", "law", "mounting", "fixed", "bounds")
    return all(getattr(method, name) == getattr(params.methods[PAPER], name) for name in names)


def mean_of(values) -> float:
    """The mean of what is finite; NaN where nothing is."""
    values = np.array(values, float)
    return float(np.nanmean(values)) if np.isfinite(values).any() else np.nan


def report(args: argparse.Namespace, params: Params, count: int, results: list[dict]) -> None:
    """Write what the results of `count` jobs say."""
    same = [name for name in args.methods if _of_one_loss(params.methods[name], params)]
    command = f"--workers {args.workers} --recordings {args.recordings} --seeds {args.seeds}"
    if args.preset:
        command += f" --preset {args.preset} --report {args.report}"
    if args.methods != list(params.methods):
        command += f" --methods {' '.join(args.methods)}"
    content = {
        "kind": "virtual",
        "asked": "What each part of the paper's method, and each baseline, changes in the distance"
        " between landing and target on recordings of the virtual rig that took part in no choice;"
        " launches without errors, aimed as a perfect policy would.",
        "settings": {
            "targets_m": params.trials.targets,
            "recordings": {
                band: sorted({result["recording"] for result in results if result["band"] == band})
                for band in args.bands
            },
            "search_seeds_on_the_first": sorted({result["seed"] for result in results}),
            "preset": args.preset,
            "pads": "open as fast as the recorded force fell",
            "optimizer": with_preset(params, PAPER, args.preset).optimizer.model_dump(),
            "rollouts": {
                name: rollouts_of_search(with_preset(params, name, args.preset), name)
                for name in args.methods
            },
            "methods": {name: params.methods[name].model_dump() for name in args.methods},
            "intervals": f"{100 * LEVEL:.0f} %, percentile bootstrap over recordings (or seeds)",
        },
        "jobs": count,
        "done": len(results),
        "processors": dict(Counter(result.get("processor", "unknown") for result in results)),
        "rank_correlation_of_loss_and_miss": {
            "methods": same,
            "over_recordings": mean_interval(rank_correlations(results, same)),
        },
        "figures": summary(results, args.bands, args.methods),
    }
    write_report(args.report, content, command)
    print(f"{args.report}: {len(results)} of {count} results", flush=True)


WORDS = {  # of the table
    PAPER: "`paper`",
    "no_work": "−L_work",
    "no_covariance": "−c",
    "no_multistart": "−m",
    "no_covariance_no_multistart": "−c, −m",
    "de": "DE_L",
    "bo": "BO_L",
    "adam": "Adam_L",
    "package_si": "Package SI",
    "real2sim2real": "Real2Sim2Real",
    NEO_HOOKEAN: "the neo-Hookean law",
}


def table(content: dict) -> list[str]:
    """The table of docs/paper.md: of each band, how much farther off than the paper's method [cm].

    Losses of methods that minimise another one than the paper's stand in brackets.
    """
    figures, bands = content["figures"], sorted({*content["figures"]} - {"all"})
    same, budgets = content["rank_correlation_of_loss_and_miss"]["methods"], content["settings"]
    heads = ("method", "rollouts", "its loss", "misses by [cm]", *bands, "bands where nearer")
    rows = [row(*heads), row("---", *["---:"] * (len(heads) - 1))]
    for method in filter(figures["all"]["methods"].__contains__, WORDS):
        words, of = WORDS[method], figures["all"]["methods"][method]
        loss = f"{of['loss']['mean']:.3f}"
        cells = [words, f"{budgets['rollouts'][method]:,}", loss if method in same else f"({loss})"]
        cells.append(f"{of['miss_cm']['mean']:.1f}")
        if method == PAPER:
            cells += ["–"] * (len(bands) + 1)
        else:
            more = [figures[band][f"less_{PAPER}"][method]["mean"] for band in bands]
            cells += [f"{value:+.1f}" for value in more]
            cells.append(f"{sum(value < 0 for value in more)} of {len(bands)}")
        rows.append(row(*cells).replace("-", "−"))
    return rows


def main() -> None:
    params = with_variants(load())
    parser = runner.parser(__doc__, REPORT, WORK)
    parser.add_argument("--preset", help="of presets/, its keys of `optimizer`")
    parser.add_argument("--bands", nargs="+", default=list(params.run.floors))
    parser.add_argument("--methods", nargs="+", default=list(params.methods))
    parser.add_argument("--first", type=int, default=FIRST, help="rig seed of the first recording")
    parser.add_argument("--recordings", type=int, default=10, help="a band (default: 10)")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="on the first (default: 5)")
    args = parser.parse_args()
    for kind in ("band", "method"):
        for name in getattr(args, f"{kind}s"):
            expect_known(params, kind, name)
    if PAPER not in args.methods:
        raise UserError(f"--methods: {PAPER} must be among them, all are compared with it")
    jobs = jobs_of(args.bands, args.methods, args.recordings, args.seeds, args.first)
    runner.prepare(args, partial(record, work=args.work), recordings_of(jobs))
    work = partial(aimed_and_launched, work=args.work, preset=args.preset)
    results = runner.results_of(args, work, jobs, processor=processor())
    report(args, params, len(jobs), results)


if __name__ == "__main__":
    errors.run(main)
