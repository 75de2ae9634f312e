"""Run everything with the large budget, ten times params.yaml's, and say how long it took.

    python tools/large.py        # as `make large`; arguments go to `sling flow`

Both budgets are this project's: the paper gives none. The large one, of
validation/benchmarks/methods.py, is written into params.yaml, for `git diff` to show and
`git checkout params.yaml reports dvc.lock` to take back; then `sling flow`. Killed, it goes on
where it was, and `seconds` in reports/run.js adds up its stretches.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.base import errors  # noqa: E402
from pipeline.base.errors import UserError  # noqa: E402
from pipeline.base.files import replacing, write_json  # noqa: E402
from pipeline.params import load  # noqa: E402
from pipeline.report.run import write_run  # noqa: E402
from validation.benchmarks.methods import LARGE  # noqa: E402

KEPT = Path(".checkpoints", "large.json")  # "runs" and the "stretches" [s] of a run without an end
TICK = 10.0  # s, that a kill may lose of its stretch


def with_budget(path: Path) -> None:
    """Write the large budget into params.yaml, whose comments stay. Raises UserError."""
    text = path.read_text(encoding="utf-8")
    for name, value in LARGE.items():
        text = re.sub(rf"(?m)^(  {name}: *)[0-9_]+", rf"\g<1>{value}", text)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
        optimizer = load(temporary).optimizer
        off = [name for name, value in LARGE.items() if getattr(optimizer, name) != value]
        if off:
            raise UserError(
                f"{path}: write optimizer.{off[0]}: {LARGE[off[0]]} on a line of its own"
            )


def timed(run: list[str], root: Path = ROOT, tick: float = TICK) -> tuple[int, list[float]]:
    """Exit status of a command, and the seconds of its stretches [s], those before a kill first.

    They are kept until it succeeds; another command begins anew.
    """
    kept = root / KEPT
    try:
        content = json.loads(kept.read_text(encoding="utf-8"))
        before = content["stretches"] if content["runs"] == run else []
    except (OSError, ValueError, KeyError, TypeError):
        before = []
    start, status = time.monotonic(), None
    process = subprocess.Popen(run, cwd=root)
    earlier = signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    while status is None:
        with suppress(subprocess.TimeoutExpired, KeyboardInterrupt):  # Ctrl-C ends the flow as well
            status = process.wait(tick)
        stretches = [*before, round(time.monotonic() - start, 1)]
        with suppress(UserError):  # a full disk, of which the flow itself will tell
            write_json(kept, {"runs": run, "stretches": stretches})
    signal.signal(signal.SIGTERM, earlier)
    if status == 0:
        kept.unlink(missing_ok=True)
    return status, stretches


def main() -> int:
    run = ["sling", "flow", *sys.argv[1:]]
    with_budget(ROOT / "params.yaml")
    status, stretches = timed(run)
    if status == 0:
        took = {
            "runs": " ".join(run),
            "seconds": round(sum(stretches)),
            "stretches": len(stretches),
        }
        print(json.dumps(write_run(ROOT / "reports", **took), indent=2))
    return status


if __name__ == "__main__":
    errors.run(main)
