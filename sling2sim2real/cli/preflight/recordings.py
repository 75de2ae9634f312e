"""Recordings brought into the project: each is checked, then all are copied or none."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from pipeline.params import load
from sling2sim2real.base.disk import expect_writable
from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.base.files import replacing, replacing_folder
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli.preflight.check import GivenBand, look_at
from sling2sim2real.cli.preflight.report import CheckReport
from sling2sim2real.recording import files as bag
from sling2sim2real.recording.files import sha256
from sling2sim2real.recording.mask_folder import MASK_NAME, masks_beside
from sling2sim2real.settings import Settings, expect_known


def add_recording(band: str, recordings: Sequence[Path], root: Path | str = ".") -> str:
    """Check further recordings of a band that is in params.yaml and copy them to data/raw/<band>.

    Returns:
        What was done, in words, and below it what of the recordings costs accuracy.

    Raises:
        UserError: in one line, where the band is not known or a recording cannot be used or is
            there already, by its name or its content. Nothing is copied then.
    """
    layout = Layout(Path(root))
    params, recordings = load(layout.root / "params.yaml"), bag.once(recordings)
    expect_known(params, "band", band, called="--band")
    there = digests(layout.recordings(band))
    files = targets(recordings, layout.raw(band))
    for file, target in files.items():
        if same := there.get(sha256(file)):
            raise UserError(f"{file}: is there already, as {same}")
        if target.exists():
            raise UserError(f"{target} is there already: give {file} another name")
    expect_writable(layout.raw(band))
    reports = checked(recordings, params, band, layout)
    copy(files)
    return summary(f"{band}: added to the {len(there)} that were there", reports)


def targets(recordings: Sequence[Path], folder: Path) -> dict[Path, Path]:
    """Where each goes: its own name in the band's folder, of a split bag as a folder.

    Raises UserError where two are one.
    """
    places: dict[Path, Path] = {}
    for file in recordings:
        name = bag.name_of(file)
        split = len(bag.parts_of(file)) > 1
        target = folder / (name.replace(".", "_") if split else f"{name}.mcap")
        if target in places.values():
            raise UserError(f"{file}: two of the recordings have this name, rename one")
        places[file] = target
    if len(digests(recordings)) < len(recordings):
        raise UserError(f"two of {', '.join(map(str, recordings))} are the same recording")
    return places


def digests(recordings: Sequence[Path]) -> dict[str, Path]:
    """The files by the hash of their content."""
    return {sha256(file): file for file in recordings}


def checked(
    recordings: Sequence[Path], params: Settings, band: str, layout: Layout
) -> list[CheckReport]:
    """What `sling check` says of each. Raises UserError where one cannot be used."""
    reports = []
    for file in recordings:
        look = look_at(file, params, GivenBand(params.bands[band]))
        reports.append(look.report)
        if not look.report.usable:
            raise UserError(f"{file}: {look.report.problem}")
    return reports


def copy(files: dict[Path, Path]) -> None:
    """All files to their targets, with the masks beside them, or none."""
    with ExitStack() as stack:
        for file, target in files.items():
            parts = bag.parts_of(file)
            if len(parts) == 1:
                shutil.copyfile(parts[0], stack.enter_context(replacing(target)))
            else:
                into = stack.enter_context(replacing_folder(target))
                for part in [*parts, *bag.metadata_of(file)]:
                    shutil.copyfile(part, into / part.name)
            _copy_masks(file, target, stack)  # they get their names before the recording does


def renew_masks(recordings: Sequence[Path], there: dict[str, Path]) -> None:
    """Masks beside these recordings, those that are there, take the place of what lies there."""
    with ExitStack() as stack:
        for digest, file in digests(recordings).items():
            if digest in there:
                _copy_masks(file, there[digest], stack)


def _copy_masks(file: Path, target: Path, stack: ExitStack) -> None:
    source, goal = masks_beside(file), masks_beside(target)
    if not source.is_dir() or (goal.exists() and goal.samefile(source)):
        return
    folder = stack.enter_context(replacing_folder(goal))
    try:
        for mask in source.iterdir():
            if MASK_NAME.fullmatch(mask.name) and mask.is_file():
                shutil.copyfile(mask, folder / mask.name)
    except OSError as error:
        raise UserError(f"{source}: cannot be copied ({error.strerror})") from error


def summary(done: str, reports: Sequence[CheckReport]) -> str:
    """What was done, a line for each pull, and what costs accuracy in the first of each file."""
    lines = []
    for report in reports:
        for pull in report.pulls:
            name = printable(Path(report.path).name)
            name += f", pull {pull.number}" if len(report.pulls) > 1 else ""
            message = f"peak force {pull.peak_force_n:.2f} N, release at {pull.release_s:.3f} s"
            lines.append(f"  {name}: {message if pull.usable else f'left out, {pull.verdict}'}")
        lines += [f"  - but {caution}" for caution in report.cautions]
    count = sum(pull.usable for report in reports for pull in report.pulls)
    pulls = "1 pull" if count == 1 else f"{count} pulls"
    return "\n".join([f"{done}, {pulls}", *lines])
