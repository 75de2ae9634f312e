"""Landings by each pull: how near and how sure, on rubbers to develop on, sealed ones, our bands.

    python -m validation.campaigns.landings develop
    python -m validation.campaigns.landings sealed     # once: validation/rubbers.py has the rules
    python -m validation.campaigns.landings bands

Each band is recorded by the paper's pull and by the informative one (`plan.dips`), virgin and as it
is after an earlier pull, and identified by the default method from that one recording; nine targets
are scored without launch noise (bias), and one launch each with it (coverage). Results are lines of
results.jsonl in --work: a run that was killed, or whose --minutes were over, goes on from there. It
writes reports/validation/landings-<set>.json. With --keep the episodes stay in --work: what comes
after them is repeated without the recording, once results.jsonl is gone.
"""

from __future__ import annotations

import argparse
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.base.environment import environment
from pipeline.base.files import write_json
from pipeline.base.machine import cores
from pipeline.params import Params, load
from rig.oracle.world import World
from validation.campaigns import runner
from validation.campaigns.rig_scores import recorded, saved, scored, sling_of, summary
from validation.campaigns.runner import OURS, ResultLines, plain, result_of
from validation.density import found
from validation.projects import DEFAULTS
from validation.rubbers import DEVELOP, RECORDINGS, SEALED, rubbers, with_rubbers

PULLS = "paper", "informative"
BANDS, TEN = ("band1", "band2", "band3"), 10
BOOTSTRAP = 2000


@dataclass(frozen=True)
class OneRecording:
    """Of a band; `worn`: it was drawn before."""

    seed: int
    band: str
    pull: str
    worn: bool
    number: int

    @property
    def params(self) -> Params:
        return with_rubbers(load(DEFAULTS), self.seed, self.number, self.pull, self.worn)


SETS = {
    "develop": (DEVELOP, tuple(rubbers(DEVELOP)), RECORDINGS, (False, True)),
    "sealed": (SEALED, tuple(rubbers(SEALED)), RECORDINGS, (False, True)),
    "bands": (DEVELOP, BANDS, TEN, (False,)),
}


def jobs(name: str, most: int = TEN, pulls: Sequence[str] = PULLS) -> list[OneRecording]:
    """At most so many recordings of each band of a set by each pull, worn ones once."""
    seed, bands, count, states = SETS[name]
    return [
        OneRecording(seed, band, pull, worn, number)
        for number in range(min(count, most))
        for worn in states
        for pull in pulls
        for band in bands
        if not (worn and number)
    ]


def identified(job: OneRecording, work: Path, keep: bool = False) -> dict:
    """Scores of the default method by one recording, and what it says of itself.

    Args:
        keep: The episode, in a folder of `work`; one that is there is taken as it is.
    """
    params, begin = job.params, time.process_time()
    folder = work / f"{job.band}-{job.pull}-{'worn' if job.worn else 'virgin'}-{job.number}"
    episode = recorded(params, job.band, folder)
    sling, start = sling_of(params, job.band, OURS, folder), time.process_time()
    outcome, told = found(params, OURS, sling, [episode])
    seconds = time.process_time() - start
    with World(job.band, saved(params, folder / "params.yaml"), workers=1) as world:
        scores = scored(outcome, params, world, seed=job.number)
    if not keep:
        shutil.rmtree(folder)
    kept = {name: told[name] for name in ("parameters", "derived", "settled", "steps")}
    return plain(
        {
            "scores": scores,
            "told": kept,
            "delays": episode.metadata["preprocessing"].get("delays"),
            "identification_s": seconds,
            "cpu_s": time.process_time() - begin,
        }
    )


def performed(job: OneRecording, work: Path, keep: bool) -> dict:
    return result_of(job, partial(identified, job, work, keep))


def figures(lines: list[dict]) -> dict:
    """By pull and state: each band's `summary`, and what they say together."""
    result: dict = {}
    for pull in PULLS:
        for worn in (False, True):
            some = [one for one in lines if one["pull"] == pull and one["worn"] == worn]
            good = [one for one in some if "failed" not in one]
            if not good:
                continue
            names = list(dict.fromkeys(one["band"] for one in good))
            of_bands = {
                name: summary([one["scores"] for one in good if one["band"] == name])
                for name in names
            }
            result[f"{pull}, {'worn' if worn else 'virgin'}"] = {
                "together": together(of_bands),
                "settled": [sum(one["told"]["settled"] for one in good), len(good)],
                "refused": {
                    f"{one['band']} {one['number']}": one["failed"]
                    for one in some
                    if "failed" in one
                },
                "bands": of_bands,
            }
    return plain(result)


def together(of_bands: dict[str, dict]) -> dict:
    """Means over bands, and of the coverage what bands drawn anew say in 90 of 100 cases."""
    bias = np.array([one["mean_bias"] for one in of_bands.values()])
    covered = np.array([one["coverage"] for one in of_bands.values()])
    rng = np.random.default_rng(0)
    drawn = rng.choice(covered, (BOOTSTRAP, len(covered))).mean(axis=1)
    return {
        "mean_size_of_bias": np.abs(bias).mean(),
        "worst_bias": bias[np.abs(bias).argmax()],
        "mean_miss_m": np.mean([one["mean_miss_m"] for one in of_bands.values()]),
        "coverage": covered.mean(),
        "coverage_by_bands": np.quantile(drawn, [0.05, 0.95]),
        "least_coverage": covered.min(),
        "median_width": np.median([one["median_width"] for one in of_bands.values()]),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("set", choices=SETS)
    parser.add_argument("--work", type=Path, default=Path(".checkpoints/landings"))
    parser.add_argument("--workers", type=int, default=cores())
    parser.add_argument("--minutes", type=float, default=1e4, help="then it ends; again: goes on")
    parser.add_argument("--pulls", nargs="+", choices=PULLS, default=PULLS)
    parser.add_argument("--keep", action="store_true", help="the episodes, and take those kept")
    parser.add_argument("--report", action="store_true", help="of what is there; nothing runs")
    parser.add_argument("--recordings", type=int, default=TEN, help="of each band, at most")
    arguments = parser.parse_args()
    work = arguments.work.resolve() / arguments.set
    results, todo = (
        ResultLines(work / "results.jsonl"),
        jobs(arguments.set, arguments.recordings, arguments.pulls),
    )
    if not arguments.report:
        limits = arguments.workers, arguments.minutes
        runner.run(partial(performed, work=work, keep=arguments.keep), todo, results, *limits)
    lines = results.among(todo)
    command = f"python -m validation.campaigns.landings {arguments.set}"
    report = environment("cpu", command) | {
        "jobs": [len(lines), len(todo)],
        "plan.dips": [dict(one) for one in load(DEFAULTS).plan.dips],
        "figures": figures(lines),
        "recordings": lines,
    }
    write_json(Path(f"reports/validation/landings-{arguments.set}.json"), report)
    for name, about in report["figures"].items():
        print(name, {key: value for key, value in about["together"].items()}, about["settled"])
    return 0


if __name__ == "__main__":
    errors.run(main)
