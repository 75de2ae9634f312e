"""Two runs of one machine, byte by byte, and how far the committed one, of another, is from them.

    python -m validation.campaigns.twice RUN OTHER

The folders are clones in which everything has run, in OTHER perhaps more. Writes
reports/validation/twice.json.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from pipeline.base import errors
from pipeline.base.files import write_json
from pipeline.base.layout import made
from validation.benchmarks.timing import environment
from validation.campaigns.machines import outputs

REPORT, TABLE = Path("reports/validation/twice.json"), Path("reports/tables/table1.csv")
COMMITTED = Path()


def landings(folder: Path) -> dict[tuple[str, str], float]:
    """Mean distance from all targets [cm], by band and method; nothing where no launch landed."""
    table = pd.read_csv(made(folder / TABLE))
    rows = table[(table.source == "virtual") & (table.target_m == "all")]
    found = rows.set_index(["band", "method"])["mean_error_cm"]
    return pd.to_numeric(found, errors="coerce").dropna().to_dict()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("runs", type=Path, nargs=2, metavar="RUN", help="folder of a whole run")
    parser.add_argument("--report", type=Path, default=REPORT, help=f"(default: {REPORT})")
    args = parser.parse_args()
    first, second = (outputs(folder / "dvc.lock") for folder in args.runs)
    others = sorted(path for path, digest in first.items() if second.get(path) != digest)
    here, committed = landings(args.runs[0]), landings(COMMITTED)
    content = {
        "kind": "virtual",
        "asked": "Two runs of one machine write the same bytes.",
        "met": not others,
        "outputs": len(first),
        "differing": others,
        "landings_cm": {
            f"{band} {method}": {"these_runs": value, "committed": committed.get((band, method))}
            for (band, method), value in here.items()
        },
    }
    command = "python -m validation.campaigns.twice RUN OTHER"
    write_json(args.report, content | environment("cpu", command))
    print(f"{args.report}: {len(others)} of {len(first)} outputs differ")
    return 1 if others else 0


if __name__ == "__main__":
    errors.run(main)
