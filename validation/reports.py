"""Reports of scripts: figures as plain JSON, with machine, versions, command and commit; tables."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from textwrap import wrap

import numpy as np

from pipeline.layout import ROOT
from sling2sim2real.base.files import write_json
from sling2sim2real.base.machine import commit, named, processor

LINE = 125  # characters of a page


def environment(device: str, command: str = "") -> dict:
    """What a figure belongs to: device, its name, cores, command, commit and versions."""
    import warp as wp

    device, name = named(device, "--device"), processor()
    if device != "cpu":
        name = wp.get_device(device).name
    packages = ("warp-lang", "numpy", "scipy")
    return {
        "device": device,
        "device_name": name,
        "cores": os.cpu_count(),
        "command": command or f"sling bench --device {device} --json",
        "commit": commit(ROOT),
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in packages},
    }


def write_report(
    path: Path,
    content: Mapping,
    arguments: str = "",
    *,
    device: str = "cpu",
    versions: Mapping[str, str] | None = None,
    digits: int | None = None,
) -> dict:
    """Write what a script has found, and what it belongs to.

    Args:
        path: The file.
        content: Figures by name; one that `environment` names too stands in its place.
        arguments: Of the command, which else is that of the script that calls this.
        device: That was measured.
        versions: Of packages beside the usual ones.
        digits: Of every float.

    Returns:
        What the file holds.
    """
    script = Path(sys._getframe(1).f_code.co_filename)
    module = ".".join(script.relative_to(ROOT).with_suffix("").parts).removesuffix(".__main__")
    provenance = environment(device, f"python -m {module} {arguments}".rstrip())
    provenance["versions"] |= versions or {}
    report = provenance | plain(content, digits)
    write_json(path, report)
    return report


def paragraph(text: str) -> list[str]:
    """Lines of a page, of at most LINE characters; a percentage is not parted from its sign."""
    return [line.replace("\xa0", " ") for line in wrap(text.replace(" %", "\xa0%"), LINE)]


def row(*cells: object) -> str:
    """A row of a Markdown table."""
    return f"| {' | '.join(map(str, cells))} |"


def plain(value: object, digits: int | None = None):
    """Convert for JSON: NumPy's numbers to Python's, not finite to null; floats to some digits."""
    if isinstance(value, dict):
        return {str(key): plain(part, digits) for key, part in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(part, digits) for part in value]
    if isinstance(value, (float, np.floating)):
        if not np.isfinite(value):
            return None
        return float(value) if digits is None else float(f"{value:.{digits}g}")
    return value.item() if isinstance(value, np.generic) else value
