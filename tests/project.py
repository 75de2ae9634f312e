"""Commands and settings for tests."""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import psutil
from ruamel.yaml import YAML

from pipeline.layout import ROOT
from validation.projects import DEFAULTS, environment, run_of, wait

# What params.yaml has of a band of one's own.
BAND = {"source": "recording", "mass": 0.0408, "diameter": 0.01, "rest_length": 0.52}
STAGES = {  # of dvc.yaml, without what they are for each of
    name: stage.get("do", stage)
    for name, stage in YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"].items()
}


def python(*arguments: str | Path, folder: Path = ROOT, **more: str) -> subprocess.CompletedProcess:
    """Run Python in `folder`, with `more` in its environment."""
    command = [sys.executable, *map(str, arguments)]
    options = {"capture_output": True, "text": True}
    return subprocess.run(command, cwd=folder, env=environment(**more), timeout=240, **options)


def write_params_of(
    root: Path, band: str, method: str, mass: float, **sections: Mapping[str, object]
) -> None:
    """Write params.yaml of a run of one recorded band by one method; `sections` have other values.

    Args:
        mass: Of the band [kg].
    """
    yaml = YAML()
    content = yaml.load(DEFAULTS)
    content.update(run_of({band: [method]}, rig=False))
    content["bands"][band] = BAND | {"mass": mass}
    content["rig"]["bands"][band] = None
    for name, values in sections.items():
        content[name].update(values)
    yaml.dump(content, root / "params.yaml")


def with_(params: Any, section: str, **values: object) -> Any:
    """`params` with other values in a section, such as rig.camera or bands.band1; "": its own."""
    if not section and isinstance(params, Mapping):
        return {**params, **values}
    if not section:
        return params.model_copy(update=values)
    first, _, rest = section.partition(".")
    inner = params[first] if isinstance(params, Mapping) else getattr(params, first)
    return with_(params, "", **{first: with_(inner, rest, **values)})


def write_files(folder: Path, files: dict[str, str]) -> None:
    """Write texts by their paths below `folder`."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def contents(folder: Path) -> dict[Path, bytes]:
    """All files below `folder`, by their places in it."""
    files = (file for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(folder): file.read_bytes() for file in files}


def texts(*patterns: str) -> list[Path]:
    """Files that Git has, or would, of names such as *.py; CHANGELOG tells of what is gone."""
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", *patterns]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = (ROOT / name for name in names.splitlines() if name != "CHANGELOG.md")
    return [file for file in files if file.is_file()]


def until(happens: Callable[[], object], seconds: float = 90.0):
    """What it gives once that is true; the test fails where it is not after so long."""
    result = wait(happens, seconds)
    assert result, f"it did not come to pass within {seconds} s"
    return result


def alive(pid: int) -> bool:
    """A zombie is not: it waits for a parent to look at it."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
