"""Random parameter sets of both laws: each rollout and launch is finite, or says why not.

    python -m validation.campaigns.random_parameters --count 10000
    python -m validation.campaigns.random_parameters --count 100000 --device cuda:0

The sets fill the box of params.yaml, and of the law `rubber` that of the simulator's checks. Half
of the rollouts have pads that hold anything, half those of the setup; as many launches go along.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.base.environment import environment
from pipeline.base.files import write_json
from pipeline.base.machine import cores
from pipeline.params import load
from pipeline.params.identification import LAWS
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.rubber import NEO_HOOKEAN, RUBBER
from validation.benchmarks.timing import timed
from validation.simulator.agreement import random_thetas
from validation.simulator.experiment import band_of
from validation.simulator.finding import Bench
from validation.simulator.robustness import HELD_FAST, SEED, survey, survey_launches
from validation.simulator.rubber import BOX

BATCH = 2_000
REPORT = "reports/validation/random-parameters-{}.json"


def random_sets(bench: Bench, law: str, count: int) -> Parameters:
    """`count` random ones of the box."""
    boxes = np.array([BOX[name] for name in LAWS[law]]).reshape(-1, 2)
    draws = np.random.default_rng(SEED).uniform(*boxes.T, (count, len(boxes)))
    others = dict(zip(LAWS[law], draws.T, strict=True))
    return Parameters.of(law, random_thetas(bench, count, SEED), **others)


def surveyed(bench: Bench, law: str, count: int, progress=print) -> dict:
    """What comes of `count` rollouts and as many launches of one law, and the seconds they took."""
    sling, sets = replace(band_of(bench), law=law), random_sets(bench, law, count)
    fast = replace(sling, grip_force=HELD_FAST)
    half = count // 2
    tasks = {
        "held_fast": lambda: survey(bench, fast, sets[:half], progress, BATCH),
        "default_grip": lambda: survey(bench, sling, sets[half:], progress, BATCH),
        "launches": lambda: survey_launches(bench, sling, sets),
    }
    surveys = {}
    for name, task in tasks.items():
        content, _, wall = timed(task)
        surveys[name] = content | {"seconds": wall}
    return surveys


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000, help="sets of each law")
    parser.add_argument("--device", default="cpu")
    requested = parser.parse_args()
    bench = Bench(load(), device=requested.device, workers=cores())
    laws = {law: surveyed(bench, law, requested.count) for law in (NEO_HOOKEAN, RUBBER)}
    unmarked = sum(counts["not_finite"] for law in laws.values() for counts in law.values())
    command = "python -m validation.campaigns.random_parameters"
    content = {
        "asked": "No rollout and no launch that is not finite and not marked as failed.",
        "sets": requested.count,
        "seed": SEED,
        "unmarked": unmarked,
        "met": unmarked == 0,
        "laws": laws,
        **environment(
            requested.device, f"{command} --count {requested.count} --device {requested.device}"
        ),
    }
    path = Path(REPORT.format(requested.device.replace(":", "-")))
    write_json(path, content)
    print(f"{path}: {unmarked} unmarked")


if __name__ == "__main__":
    errors.run(main)
