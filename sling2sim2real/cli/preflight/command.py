"""`sling check`: the report, and what else was asked for."""

from __future__ import annotations

import json
from pathlib import Path

from sling2sim2real.api.band_folder import BANDS, BandFolder, lab_settings
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.command_line import say
from sling2sim2real.cli.preflight.check import GivenBand, look_at
from sling2sim2real.cli.preflight.output import expect_writable, written
from sling2sim2real.cli.preflight.pictures import expect_new, write_pictures
from sling2sim2real.cli.preflight.report import to_json, to_text
from sling2sim2real.settings import Settings

DRAWN = "sheet", "pictures"


def check_band(
    folder: BandFolder, sizes: dict[str, float], *, as_json: bool, **options
) -> tuple[str, int]:
    """Look at all recordings of a band's folder, whose band.yaml says what it is.

    Returns:
        Their reports, and 1 where any of them cannot be used.

    Raises:
        UserError: Sizes are given too; it has none, or several and something is to be drawn.
    """
    if sizes:
        raise UserError(f"{folder.band_file} has the band's sizes: leave these out")
    recordings = folder.recordings
    if not recordings or (len(recordings) > 1 and any(map(options.get, DRAWN))):
        names = ", ".join(map(str, recordings)) or "none"
        raise UserError(f"{folder.path}: name one recording, of {names}")
    band = GivenBand(folder.settings.bands[folder.name], str(folder.band_file))
    done = [checked(file, folder.settings, band, as_json=as_json, **options) for file in recordings]
    texts = [text for text, _ in done]
    if as_json and len(texts) > 1:
        texts = [json.dumps({"recordings": [json.loads(text) for text in texts]}, indent=2)]
    return "\n\n".join(texts), max(status for _, status in done)


def check(recording: Path, sizes: dict[str, float], **options) -> tuple[str, int]:
    """Look at a recording by the settings of the lab, and draw it where that is asked for.

    Args:
        recording: An MCAP file, or a bag's folder.
        sizes: What is known of its band [kg, m].
        options: As `checked` has them.
    """
    settings = lab_settings()
    if not (BANDS / "lab.yaml").is_file():
        say(f"no {BANDS / 'lab.yaml'} here: the usual settings hold")
    return checked(recording, settings, GivenBand.of(sizes, settings.setup), **options)


def checked(
    recording: Path,
    params: Settings,
    band: GivenBand,
    *,
    as_json: bool = False,
    sheet: Path | None = None,
    pictures: Path | None = None,
    pull: int | None = None,
) -> tuple[str, int]:
    """Look at a recording; draw it where that is asked for.

    Args:
        params: Settings of the lab.
        band: With what is known of it.
        as_json: The report as JSON, with what was drawn under `written`.
        sheet: File to write.
        pictures: Folder to write, of what `cloud.mask: folder` wants masks of.
        pull: Which of several; None for the first that can be used, if there is one.

    Returns:
        The report, and exit status 0 where the pull can be used, else 1.

    Raises:
        UserError: in one line, before anything is read where an output cannot be written.
    """
    if sheet:
        expect_writable(sheet, ".png")
    if pictures:
        expect_new(pictures)
    look = look_at(recording, params, band, pull)
    if sheet:
        from sling2sim2real.cli.preflight.sheet import draw_sheet

        with written(sheet):
            look.report["written"].append(draw_sheet(look, params, sheet))
    if pictures:
        with written(pictures):
            message = write_pictures(look.pulls, pictures)
        look.report["written"].append(message)
    text = to_json(look.report) if as_json else to_text(look.report)
    return text, int(look.report["problem"] is not None)
