"""What a figure belongs to: machine, versions, command and code."""

from __future__ import annotations

import os
import platform
import sys
from importlib.metadata import version
from pathlib import Path

from pipeline.base.code import ROOT, digests
from pipeline.base.fingerprint import fingerprint
from pipeline.base.machine import commit, named, processor

SIMULATOR = fingerprint(ROOT / "pipeline/simulator")[:12]  # as it is imported


def environment(device: str, command: str = "", *scripts: Path) -> dict:
    """What a figure belongs to: device, its name, command, versions, commit and code.

    `code` has a digest of each folder that `scripts` import, by default the file that calls this;
    it tells also where there is no git. `simulator` is that of pipeline/simulator.
    """
    import warp as wp

    scripts = scripts or (Path(sys._getframe(1).f_code.co_filename),)
    devices, name = named(device, "--device"), processor()
    if device != "cpu":
        name = wp.get_device(devices[0]).name
    packages = ("warp-lang", "numpy", "scipy")
    return {
        "device": device,
        "device_name": name,
        "devices": len(devices),
        "cores": os.cpu_count(),
        "command": command or f"sling bench --device {device} --json",
        "commit": commit(ROOT),
        "simulator": SIMULATOR,
        "code": digests(*scripts),
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in packages},
    }
