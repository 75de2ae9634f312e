"""What every stage's script begins with: its arguments, params.yaml, and inputs that are there."""

from __future__ import annotations

import sys
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.params import Params, expect_known, load, pairs


def arguments(*names: str) -> list[str]:
    """As many arguments as `names` (band, method); anything else prints the usage and exits 2."""
    given = sys.argv[1:]
    if len(given) != len(names) or any(one.startswith("-") for one in given):
        script = f"stages.{Path(sys.argv[0]).stem}"
        print(" ".join(["usage: python -m", script, *map(str.upper, names)]), file=sys.stderr)
        sys.exit(2)
    return given


def started(*names: str) -> tuple[Params, *tuple[str, ...]]:
    """params.yaml and the stage's arguments, each of which it must know. Raises UserError."""
    given = arguments(*names)
    params = load()
    for name, value in zip(names, given, strict=True):
        expect_known(params, name, value)
    return params, *given


def expect(path: Path, stage: str) -> Path:
    """`path`, which `stage` makes. Raises UserError where it is missing."""
    if not path.is_file():
        raise UserError(f"{path}: missing; `dvc repro {stage}` makes it")
    return path


def expect_from(run, step: str, band: str, method: str, path: Path) -> Path:
    """`path`, which `step` makes for a band and a method. Raises UserError where it is missing.

    Args:
        run: params.yaml's `run`, which says by what name the step goes; read only if need be.
    """
    if path.is_file():
        return path
    raise UserError(f"{path}: missing; {remedy(run, step, band, method)}")


def remedy(run, step: str, band: str, method: str, *, damaged: bool = False) -> str:
    """In words how a user gets what `step` makes for a band and a method, or gets it anew."""
    if (band, method) not in pairs(run):
        return (
            f"name {method} under run.methods or run.ablations in params.yaml,"
            " then `dvc repro` makes it"
        )
    stage = f"{'' if method in run.methods else 'ablation_'}{step}@{band}-{method}"
    return (
        f"`dvc repro --force {stage}` makes it anew" if damaged else f"`dvc repro {stage}` makes it"
    )


def expect_episode(band: str) -> Path:
    """Folder of the band's episode. Raises UserError where it is missing."""
    folder = Path("data/episodes", band)
    for name in ("signals.parquet", "clouds.parquet"):
        expect(folder / name, f"episode@{band}")
    return folder
