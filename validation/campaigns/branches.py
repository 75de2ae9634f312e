"""Does the density believe relaxation that no recording shows? Branches from 0.3 s on instead.

    python -m validation.campaigns.branches

The law's branches of relaxation begin at 3 ms (pipeline/simulator/rubber.py). A recording shows
them from some tenths of a second on; what is faster acts in the recoil alone, where the prior of
the loss factor, published at 10 to 100 Hz, holds all losses already. A branch of 0.3 s has less
than a twentieth of its weight as loss at 10 Hz.

Identifies the first three recordings by dips of the develop rubbers and of the rig's bands, and
those of the sealed rubber that is farthest off, with branches from FIRST on. The rule, written
before any of the 21 was run: the law's branches are to begin there, and a fresh seed to be sealed,
if over the 21 the mean over bands of |bias| is less than in landings-develop.json and
landings-bands.json, and at most 3 points fewer launches are inside. Writes
reports/validation/landings-branches.json.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

import pipeline.simulator
from pipeline.base import errors
from pipeline.simulator import rubber
from validation.campaigns import landings, runner
from validation.campaigns.landings import BANDS, OneRecording
from validation.campaigns.outlier import farthest
from validation.campaigns.rig_scores import summaries
from validation.reports import write_report
from validation.rubbers import DEVELOP, RECORDINGS, SEALED, rubbers

WORK, REPORT = Path(".checkpoints/branches"), Path("reports/validation/landings-branches.json")
FIRST = 0.3  # s
KIND = "informative, virgin"
USERS = "rubber", "launch"  # modules of pipeline.simulator that have TIMES


@contextmanager
def branches_from(first: float) -> Iterator[None]:
    """Within it the law's branches begin at a time [s], as many as before."""
    times = np.geomspace(first, rubber.TIMES[-1], len(rubber.TIMES))
    modules = [sys.modules[f"{pipeline.simulator.__name__}.{name}"] for name in USERS]
    with (
        patch.object(rubber, "DECADES", np.log10(times[1] / times[0])),
        patch.object(modules[0], "TIMES", times),
        patch.object(modules[1], "TIMES", times),
    ):
        yield


def identified(job: OneRecording, work: Path) -> dict:
    with branches_from(FIRST):
        return landings.identified(job, work)


def before(job: OneRecording) -> dict:
    """The committed scores of a recording, with branches as they are."""
    names = {DEVELOP: "bands" if job.band in BANDS else "develop", SEALED: "sealed"}
    content = runner.read(landings.report_of(names[job.seed]))
    keys = ("band", "number", "pull", "worn", "method", "launched")
    wanted = {key: getattr(job, key) for key in keys}
    return next(
        line
        for line in content["recordings"]
        if all(line[key] == value for key, value in wanted.items())
    )


def figures(lines: list[dict]) -> dict:
    """Summaries of bands, and what they say together."""
    by_band = summaries(lines, "band")
    return {"together": landings.together(by_band), "bands": by_band}


def main() -> None:
    args = runner.parser(__doc__, REPORT, WORK).parse_args()
    seeds = dict.fromkeys((*rubbers(DEVELOP), *BANDS), DEVELOP) | {farthest(): SEALED}
    todo = [
        OneRecording(seed, band, "informative", False, number)
        for number in range(RECORDINGS)
        for band, seed in seeds.items()
    ]
    lines = runner.results_of(args, partial(identified, work=args.work), todo)
    jobs = [runner.job_of(line, OneRecording) for line in lines]
    groups = {"21 recordings": DEVELOP, "sealed, farthest off": SEALED}
    content: dict = {"jobs": [len(lines), len(todo)], "first_branch_s": FIRST, "figures": {}}
    for name, seed in groups.items():
        there = [(job, line) for job, line in zip(jobs, lines, strict=True) if job.seed == seed]
        good = [(job, line) for job, line in there if "failed" not in line]
        if not good:
            continue
        content["figures"][name] = {
            "failed": len(there) - len(good),
            "before": figures([before(job) for job, _ in good]),
            "after": figures([line for _, line in good]),
        }
    for name, both in write_report(args.report, content)["figures"].items():
        for side in ("before", "after"):
            together = both[side]["together"]
            print(f"{name}, {side}:", {key: together[key] for key in sorted(together)}, flush=True)


if __name__ == "__main__":
    errors.run(main)
