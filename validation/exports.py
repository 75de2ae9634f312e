"""`python -m validation.exports [BAND...]`: write reports/validation/export-mjcf.json.

Each band that a run has identified is exported to MuJoCo and replayed there.
"""

from __future__ import annotations

import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

from app.export.card import ASKED
from app.export.export import of_run
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.params import load
from validation.benchmarks.timing import environment

REPORT = Path("reports/validation/export-mjcf.json")
KEPT = (
    "met",
    "proof",
    "matched",
    "time_step_s",
    "time_step_error",
    "springs_error",
    "pull",
    "match",
)


def main(bands: list[str]) -> None:
    """Export, replay, write. Raises UserError."""
    params, found = load(), {}
    for band in bands or params.run.bands:
        with tempfile.TemporaryDirectory() as folder:
            _, card = of_run(params, band, params.run.methods[0], "mjcf", Path(folder))
        found[band] = {name: card[name] for name in KEPT}
        print(f"{band}: {'met' if card['met'] else 'NOT met'}", flush=True)
    about = environment("cpu", "python -m validation.exports")
    about["versions"] |= {"mujoco": version("mujoco")}
    met = all(one["met"] for one in found.values())
    write_json(REPORT, {"asked": ASKED, "met": met, "bands": found, **about})


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except UserError as error:
        sys.exit(f"error: {error}")
