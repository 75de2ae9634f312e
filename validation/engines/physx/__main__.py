"""`python -m validation.engines.physx`: write reports/validation/physx.json."""

import math
import sys
from dataclasses import asdict
from pathlib import Path

from pipeline.base.environment import environment
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.params import load
from validation.engines.physx import bands, study
from validation.simulator.finding import Bench, Measure, unmet

REPORT = Path("reports/validation/physx.json")
DEVICE = "cuda:0"


def main() -> None:
    """Compare, time, write. Raises UserError."""
    version = bands.release()
    provenance = environment(DEVICE, "python -m validation.engines.physx")
    bench = Bench(load(), device=DEVICE)
    with bands.Engine() as engine:
        speeds = study.speeds(bench, engine)
        checks = study.pulls(bench, engine)
    provenance["versions"] |= {"ovphysx": version}
    content = {
        "asked": study.ASK,
        "met": not unmet(checks) and study.fast_enough(speeds),
        "checks": [_plain(check) for check in checks],
        "speeds": speeds,
    }
    write_json(REPORT, content | provenance)


def _plain(check: Measure) -> dict:
    value = check.value if math.isfinite(check.value) else None
    return asdict(check) | {"met": check.met, "value": value}


if __name__ == "__main__":
    try:
        main()
    except UserError as error:
        sys.exit(f"error: {error}")
