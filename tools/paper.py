"""Run everything with the paper's budget, and say where and how in reports/run.json.

    python tools/paper.py        # as `make paper`

`dvc exp run` with the budget of pipeline/bench_methods.py: params.yaml keeps it afterwards, for
`git diff` to show and `git checkout params.yaml` to take back. Killed, it goes on where it was.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.bench import environment  # noqa: E402
from pipeline.bench_methods import PAPER  # noqa: E402
from pipeline.files import write_json  # noqa: E402


def command(arguments: list[str]) -> list[str]:
    settings = [f"optimizer.{name}={value}" for name, value in PAPER.items()]
    return ["dvc", "exp", "run", *(part for one in settings for part in ("-S", one)), *arguments]


def main() -> int:
    run = command(sys.argv[1:])
    about = environment("cpu", "make paper")
    start = time.monotonic()
    status = subprocess.run(run, cwd=ROOT, check=False).returncode
    if status == 0:
        about |= {"runs": " ".join(run), "seconds": round(time.monotonic() - start)}
        write_json(ROOT / "reports" / "run.json", about)
        print(json.dumps(about, indent=4))
    return status


if __name__ == "__main__":
    sys.exit(main())
