"""reports/run.js: where and when the report was written, for the page alone.

Git and DVC know nothing of it, so that all they know is the same wherever and whenever it is made.
"""

from __future__ import annotations

import json
import os
import platform
import time
from importlib.metadata import version
from pathlib import Path

from sling2sim2real.base.files import write_text
from sling2sim2real.base.machine import commit, cores, processor

PACKAGES = ("numpy", "scipy", "warp-lang", "cma", "torch", "rsl-rl-lib", "pyarrow", "dvc")


def write_run(folder: Path, **more: object) -> dict:
    """Write run.js into `folder`, with `more` beside what this machine is; return what it says."""
    description = {
        "written": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "commit": commit(folder) or "unknown",
        "machine": f"{processor()}, {cores()} cores",
        "device": os.environ.get("SLING_DEVICE") or "cpu",
        **more,
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }
    write_text(folder / "run.js", f"run = {json.dumps(description, indent=2)}\n")
    return description
