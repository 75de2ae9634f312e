"""Take a band of one's own out of the project: what `sling fit` brought in, and what came of it."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from pipeline.params import Params, load
from sling2sim2real.base.disk import expect_writable
from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.base.files import write_text
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli.command_line import say
from sling2sim2real.cli.params_file import edited
from sling2sim2real.settings import expect_known


def remove_band(name: str, agreed: Callable[[list[str]], bool], root: Path | str = ".") -> str:
    """Remove a recorded band from params.yaml, data/, reports/ and the checkpoints.

    Killed, the same command goes on: params.yaml comes last. dvc.lock and DVC's
    cache keep what they have: the same band brought in again is found there.

    Args:
        name: Of the band.
        agreed: Gets what is to be removed, a line each, and says whether it may.
        root: Of the project.

    Returns:
        What was done, in words.

    Raises:
        UserError: There is no such band, it is the rig's, or the run cannot do without it; or
            `agreed` said no. Nothing is removed.
    """
    root = Path(root)
    path, layout = root / "params.yaml", Layout(root)
    params = load(path)
    expect_known(params, "band", name)
    if params.bands[name].source == "rig":
        raise UserError(
            f"{name}: is a band of the virtual rig, on which the committed results rest; this"
            " removes recorded bands alone"
        )
    text = edited(path.read_text("utf-8"), lambda content: _forget(content, name))
    Params.parse(text, str(path))
    files = files_of(layout, name)
    expect_writable(path.parent, *files, *(file.parent for file in files))
    lines = [f"bands.{name} of {path}, and where run: names it", *map(str, files)]
    if not agreed(lines):
        raise UserError(f"{name}: is kept; with --yes nobody is asked")
    for file in files:
        shutil.rmtree(file) if file.is_dir() else file.unlink()
    write_text(path, text)
    return "\n".join([f"{name} removed:", *(f"  {line}" for line in lines)])


def files_of(layout: Layout, band: str) -> list[Path]:
    """Whatever bears the band's name, as far as it is there."""
    files = {
        *layout.data.glob(f"*/{band}"),
        *layout.data.glob(f"*/{band}.*"),
        *layout.measured.glob(f"{band}.csv"),
        *layout.card(band).parent.glob(band),
        *layout.root.glob(f".checkpoints/{band}-episodes"),
    }
    return sorted(files)


def ask(lines: list[str]) -> bool:
    """Ask at the terminal; without one the answer is no."""
    if not sys.stdin.isatty():
        return False
    for line in lines:
        say(f"  {printable(line)}")
    print("remove all this? [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _forget(content: CommentedMap, name: str) -> None:
    """Take the band out of `bands` and out of the lists of `run`."""
    del content["bands"][name]
    for bands in (
        content["run"]["bands"],
        content["run"]["own"],
        content["run"]["ablations"]["bands"],
    ):
        if name in bands:
            bands.remove(name)
