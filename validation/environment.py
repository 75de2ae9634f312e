"""What a figure belongs to: machine, versions, command and commit."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version

from pipeline.layout import ROOT
from sling2sim2real.base.machine import commit, named, processor


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
