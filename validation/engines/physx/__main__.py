"""`python -m validation.engines.physx`: write reports/validation/physx.json."""

from pathlib import Path

from pipeline.base import errors
from pipeline.params import load
from validation.engines.physx import bands, study
from validation.reports import write_report
from validation.simulator.finding import Bench, unmet

REPORT = Path("reports/validation/physx.json")
DEVICE = "cuda:0"


def main() -> None:
    """Compare, time, write. Raises UserError."""
    versions, bench = {"ovphysx": bands.release()}, Bench(load(), device=DEVICE)
    with bands.Engine() as engine:
        speeds = study.speeds(bench, engine)
        checks = study.pulls(bench, engine)
    content = {
        "asked": study.ASK,
        "met": not unmet(checks) and study.fast_enough(speeds),
        "checks": [check.entry for check in checks],
        "speeds": speeds,
    }
    write_report(REPORT, content, device=DEVICE, versions=versions)


if __name__ == "__main__":
    errors.run(main)
