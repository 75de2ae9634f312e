"""Why one rubber lands far from what is expected: its parts left out, one at a time.

    python -m validation.campaigns.outlier

The sealed rubber that is farthest off by the pull with dips (landings-sealed.json) is recorded
again as it is, without its flow, and with more viscosity. Writes
reports/validation/landings-outlier.json.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pipeline.base import errors
from pipeline.params import Params, load
from rig.oracle.world import World
from validation.campaigns import runner
from validation.campaigns.landings import report_of
from validation.campaigns.rig_scores import recorded, saved, scored, sling_of, summary
from validation.campaigns.runner import OURS, read
from validation.density import calibrated_by
from validation.projects import DEFAULTS, changed
from validation.reports import write_report
from validation.rubbers import SEALED, with_rubbers

WORK, REPORT = Path(".checkpoints/outlier"), Path("reports/validation/landings-outlier.json")
USUAL = 0.0015  # s, of viscosity: within what the rubbers' seed draws
CHANGES: dict[str, dict] = {
    "as it is": {},
    "without its flow": {"flow": None},
    "with more viscosity": {"viscosity": USUAL},
}


@dataclass(frozen=True)
class Changed:
    """A rubber with one part changed."""

    band: str
    change: str

    @property
    def params(self) -> Params:
        params = with_rubbers(load(DEFAULTS), SEALED, 0, "informative")
        change = CHANGES[self.change].items()
        return changed(params, {f"rig.bands.{self.band}.{key}": value for key, value in change})


def farthest() -> str:
    """Name of the sealed rubber with the largest bias by dips."""
    bands = read(report_of("sealed"))["figures"]["informative, virgin"]["bands"]
    return max(bands, key=lambda name: abs(bands[name]["mean_bias"]))


def identified(job: Changed, work: Path) -> dict:
    params, folder = job.params, work / job.change.replace(" ", "-")
    episode = recorded(params, job.band, folder)
    outcome, confidence = calibrated_by(
        params, OURS, sling_of(params, job.band, OURS, folder), [episode]
    )
    with World(job.band, saved(params, folder / "params.yaml"), workers=1) as world:
        scores = scored(outcome, params, world, seed=0)
    return {"scores": scores, "parameters": confidence["parameters"]}


def main() -> None:
    args = runner.parser(__doc__, REPORT, WORK).parse_args()
    band, rows = farthest(), {}
    todo = [Changed(band, name) for name in CHANGES]
    for line in runner.results_of(args, partial(identified, work=args.work), todo):
        if "failed" in line:
            rows[line["change"]] = {"failed": line["failed"]}
            continue
        figures = summary([line["scores"]])
        loss = line["parameters"]["elasticity_damping"]
        rows[line["change"]] = figures | {"damping_s": [loss["low"], loss["high"]]}
        print(f"{line['change']}: bias {100 * figures['mean_bias']:+.1f} %", flush=True)
    write_report(args.report, {"band": band, "changes": CHANGES, "figures": rows})


if __name__ == "__main__":
    errors.run(main)
