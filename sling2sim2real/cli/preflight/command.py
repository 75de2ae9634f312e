"""`sling check`: the report, and what else was asked for."""

from __future__ import annotations

from pathlib import Path

from sling2sim2real.cli.preflight.check import band_of, look_at
from sling2sim2real.cli.preflight.output import expect_writable, written
from sling2sim2real.cli.preflight.pictures import expect_new, write_pictures
from sling2sim2real.settings import Settings


def check(
    recording: Path,
    params: Settings,
    *,
    band: str | None = None,
    mass: float | None = None,
    diameter: float | None = None,
    rest_length: float | None = None,
    as_json: bool = False,
    frames: bool = False,
    sheet: Path | None = None,
    rrd: Path | None = None,
    pictures: Path | None = None,
    pull: int | None = None,
) -> tuple[str, int]:
    """Look at a recording; draw it where that is asked for.

    Args:
        recording: The MCAP file.
        params: The whole params.
        band: One of params.bands.
        mass, diameter, rest_length: Of a band that is not there yet [kg, m].
        as_json: The report as JSON, with what was drawn under `written`.
        frames: There, a row a picture under `coverage`.
        sheet, rrd: Files to write.
        pictures: Folder to write, of what `cloud.mask: folder` wants masks of.
        pull: Which of several; None for the first that can be used, if there is one.

    Returns:
        The report, and exit status 0 where the pull can be used, else 1.

    Raises:
        UserError: in one line, before anything is read where an output cannot be written.
    """
    if sheet:
        expect_writable(sheet, ".png")
    if rrd:
        expect_writable(rrd, ".rrd")
    if pictures:
        expect_new(pictures)
    look = look_at(recording, params, band_of(params, band, mass, diameter, rest_length), pull)
    if sheet:
        from sling2sim2real.cli.preflight.sheet import draw_sheet

        with written(sheet):
            look.report.written.append(draw_sheet(look, params, sheet))
    if rrd:
        from sling2sim2real.cli.preflight.timeline import write_timeline

        with written(rrd):
            look.report.written.append(write_timeline(look, params, rrd))
    if pictures:
        with written(pictures):
            message = write_pictures(look.pulls, pictures)
        look.report.written.append(message)
    report = look.report
    return report.to_json(frames) if as_json else report.to_text(), int(not report.usable)
