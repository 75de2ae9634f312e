"""Run everything with a preset of presets/, and say how long it took.

    python tools/preset.py large    # as `make large`; further arguments go to `sling flow`

The preset's keys are written into params.yaml, for `git diff` to show and `git checkout` to take
back (of reports and dvc.lock too, for its results); then `sling flow`. In the end it says where it
ran, and how many seconds it took. Killed, it goes on where it was when it is called again, whose
time is then that of the rest.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

from dvc.utils.serialize import dumps_yaml, parse_yaml_for_update

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.params import Params  # noqa: E402
from sling2sim2real.base import errors  # noqa: E402
from sling2sim2real.base.errors import UserError  # noqa: E402
from sling2sim2real.base.files import write_text  # noqa: E402
from sling2sim2real.base.machine import commit, cores, processor  # noqa: E402

PRESETS = ROOT / "presets"


def preset(name: str) -> dict:
    """What presets/<name>.yaml holds. Raises UserError."""
    path = PRESETS / f"{name}.yaml"
    if not path.is_file():
        presets = ", ".join(sorted(preset_file.stem for preset_file in PRESETS.glob("*.yaml")))
        raise UserError(f"{name}: no such preset; there are {presets}")
    return parse_yaml_for_update(path.read_text(encoding="utf-8"), str(path))


def write_preset(path: Path, changes: dict) -> None:
    """Write a preset's keys into params.yaml, in DVC's form; comments stay. Raises UserError.

    Its `run` replaces that of params.yaml: another run has other entries.
    """
    content = parse_yaml_for_update(path.read_text(encoding="utf-8"), str(path))
    _merge(content, changes)
    text = dumps_yaml(content)
    Params.parse(text, str(path))
    write_text(path, text)


def _merge(content: dict, changes: dict) -> None:
    for key, value in changes.items():
        if key != "run" and isinstance(value, dict):
            _merge(content[key], value)
        else:
            content[key] = value


def status_of(run: list[str]) -> int:
    """Exit status of a command, which ends by whatever signal ends us."""
    process = subprocess.Popen(run, cwd=ROOT)
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    with suppress(KeyboardInterrupt):  # a terminal's Ctrl-C reaches both
        process.wait()
    return process.wait()


def main() -> int:
    if len(sys.argv) < 2:
        raise UserError("usage: python tools/preset.py NAME [arguments of `sling flow`]")
    name, *more = sys.argv[1:]
    run = ["sling", "flow", *more]
    write_preset(ROOT / "params.yaml", preset(name))
    start = time.monotonic()
    status = status_of(run)
    if status == 0:
        seconds = round(time.monotonic() - start)
        about = {"runs": " ".join(run), "preset": name, "seconds": seconds}
        about |= {"commit": commit(ROOT), "machine": f"{processor()}, {cores()} cores"}
        print(json.dumps(about, indent=2))
    return status


if __name__ == "__main__":
    errors.run(main)
