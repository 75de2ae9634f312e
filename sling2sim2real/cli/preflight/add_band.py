"""Bring a recorded band into the project: check it, keep copies, and name it in params.yaml."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from pipeline.params import Params, load
from sling2sim2real.base.disk import expect_writable
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_text
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli.params_file import edited
from sling2sim2real.cli.preflight import recordings as files
from sling2sim2real.cli.sizes import DIAMETER, REST_LENGTH, assumed
from sling2sim2real.recording.files import once

NAME = re.compile(r"[a-z][a-z0-9_]*")


def add_band(
    name: str,
    recordings: Sequence[Path],
    mass: float,
    diameter: float | None = None,
    rest_length: float | None = None,
    root: Path | str = ".",
) -> str:
    """Check recordings, copy them to data/raw and add their band to params.yaml and to run.own.

    Nothing is written unless everything is right; params.yaml comes last. Adding the same band
    with the same recordings again changes nothing.

    Args:
        name: Of the band: small letters, digits and _.
        recordings: MCAP files, or bags' folders.
        mass: Of the band [kg].
        diameter: Of its section [m]; None, which is said: a common one.
        rest_length: Between the clamps [m]; None as for the diameter.
        root: Folder of the project.

    Returns:
        What was done, in words, and below it what of the recordings costs accuracy.

    Raises:
        UserError: in one line, about the first thing that is wrong.
    """
    if not NAME.fullmatch(name):
        raise UserError(f"band name {name!r}: use small letters, digits and _, a letter first")
    path, layout = Path(root) / "params.yaml", Layout(Path(root))
    recordings = once(recordings)
    before = load(path)
    sizes = {"diameter": DIAMETER if diameter is None else diameter}
    sizes["rest_length"] = REST_LENGTH if rest_length is None else rest_length
    band = {"source": "recording", "mass": mass, **sizes}
    there_before = name in before.bands
    if there_before and before.bands[name].model_dump(include={*band}) != band:
        raise UserError(
            f"{path}: bands.{name} is there already with other values: choose another name,"
            f" or correct it (`sling fit --name {name} --mass ...`)"
        )
    text = _with_band(path, name, band)
    after = Params.parse(text, str(path))
    new = files.targets(recordings, layout.raw(name))
    there = files.digests(layout.recordings(name))
    same = there and there.keys() == files.digests(recordings).keys()
    if there and not same:
        raise UserError(
            f"{layout.raw(name)} holds other recordings already: choose another name, or"
            f" `sling add-recording --band {name}`"
        )
    if same and there_before and name in (*before.run.bands, *before.run.own):
        files.renew_masks(recordings, there)
        return f"{name} is there already: nothing to do"

    expect_writable(layout.root, layout.raw(name))
    reports = files.checked(recordings, after, name, layout)
    if same:
        files.renew_masks(recordings, there)
    else:
        files.copy(new)
    write_text(path, text)
    done, taken = files.summary(f"{name} added", reports), assumed(diameter, rest_length)
    return f"{done}\n  assumed: {taken}" if taken else done


def _with_band(path: Path, name: str, band: dict[str, object]) -> str:
    """The text of params.yaml with the band in `bands` and in `run.own`, all else as it was."""

    def add(content: CommentedMap) -> None:
        if name not in content["bands"]:
            content["bands"][name] = band
        if name not in (*content["run"]["bands"], *content["run"]["own"]):
            content["run"]["own"].append(name)

    return edited(path.read_text(encoding="utf-8"), add)
