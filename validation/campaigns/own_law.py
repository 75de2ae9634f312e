"""Simulation-based calibration of the density: are its intervals true where its model is?

    python -m validation.campaigns.own_law
    python -m validation.campaigns.own_law --report-only   # of what is there

Coordinates and nuisances are drawn from the density's own priors, an episode of EPISODES by each
pull is simulated from them with the density's own noise (validation/own_law.py), and identified by
the default method. Ranks of the truth are even, and 90 % intervals hold 90 %, where all is right.
Results are lines of results.jsonl in --work: a run that was killed goes on from there. It writes
reports/validation/density-own-law.json.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.params import load
from validation.campaigns import runner
from validation.campaigns.runner import OURS
from validation.own_law import ranked
from validation.projects import DEFAULTS
from validation.ranks import summary
from validation.reports import write_report

WORK, REPORT = Path(".checkpoints/own-law"), Path("reports/validation/density-own-law.json")
PULLS, EPISODES = ("informative", "paper"), 200
HELD = 0.85, 0.95  # of each coordinate's and of the landings' 90 % intervals


@dataclass(frozen=True)
class Drawn:
    """An episode of the density's own model."""

    pull: str
    number: int


def identified(job: Drawn) -> dict:
    params = load(DEFAULTS)
    dips = params.plan.dips if job.pull == "informative" else ()
    return ranked(params, OURS, dips, [19, PULLS.index(job.pull), job.number])


def figures(lines: list[dict]) -> dict:
    """Figures by pull: what the ranks of each coordinate and of the landings say."""
    result = {}
    for pull in PULLS:
        some = [line for line in lines if line["pull"] == pull]
        good = [line for line in some if "failed" not in line]
        if not good:
            continue
        parts = {
            name: np.array([line["below"][name] for line in good], float)
            for name in good[0]["below"]
        }
        ranks = {name: summary(part[np.isfinite(part)]) for name, part in parts.items()}
        result[pull] = {
            "episodes": len(good),
            "refused": [line["failed"] for line in some if "failed" in line],
            "settled": sum(line["settled"] for line in good),
            "ranks": ranks,
            "met": all(HELD[0] <= rank["coverage"] <= HELD[1] for rank in ranks.values()),
        }
    return result


def main() -> None:
    parser = runner.parser(__doc__, REPORT, WORK)
    parser.add_argument("--episodes", type=int, default=EPISODES, help="of each pull, at most")
    args = parser.parse_args()
    todo = [Drawn(pull, number) for number in range(args.episodes) for pull in PULLS]
    lines = runner.results_of(args, identified, todo)
    content = {
        "kind": "virtual",
        "asked": "90 % intervals of each coordinate and of a launch hold 85 to 95 % of 200 truths"
        " that are drawn from the priors, with all nuisances.",
        "jobs": [len(lines), len(todo)],
        "figures": figures(lines),
        "episodes": lines,
    }
    for pull, pull_figures in write_report(args.report, content, digits=4)["figures"].items():
        print(f"{pull}: {pull_figures['episodes']} episodes, {pull_figures['settled']} settled")
        for name, rank in pull_figures["ranks"].items():
            print(f"  {name}: {rank}")


if __name__ == "__main__":
    errors.run(main)
