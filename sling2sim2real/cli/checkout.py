"""Commands of a checkout of the project: each runs a module there, with the arguments as given."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from sling2sim2real.base.errors import UserError

COMMANDS = {  # what `python -m` runs in the folder of dvc.yaml, and what that does
    "flow": ("pipeline.flow", "run stale stages in parallel, as a flow of Prefect's"),
    "ui": ("pipeline.flow.server", "serve the Prefect UI, with past and present runs"),
    "verify": ("validation.verify", "compare the simulator with closed forms and other engines"),
    "bench": ("validation.bench", "measure rollouts and launches per second"),
}


def run(command: str, arguments: Sequence[str], start: Path | None = None) -> NoReturn:
    """Become that module's process. Raises UserError outside of a checkout."""
    start = start or Path.cwd()
    for folder in (start, *start.parents):
        if (folder / "dvc.yaml").is_file():
            os.chdir(folder)
            module, _ = COMMANDS[command]
            os.execv(sys.executable, [sys.executable, "-m", module, *arguments])
    raise UserError(
        f"sling {command}: needs a checkout of the project: no dvc.yaml in {start} or above"
    )
