"""Whether a band has changed from one recording to the next: `sling drift`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

from app.drift.change import FALSE_ALARM, ChangeOfBand, changes, newest
from app.drift.picture import over_time
from app.drift.recordings import COMPARED, IdentifiedRecording, identified, in_time
from app.flow.disk import expect_writable
from app.sizes import DIAMETER, REST_LENGTH
from app.stretched import further
from pipeline.base.environment import environment
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.layout import Layout
from pipeline.params import expect_known
from pipeline.recording.input.bag import once
from pipeline.report.quantities import QUANTITIES
from sling2sim2real.identification import METHOD
from sling2sim2real.model import Band
from sling2sim2real.settings import Settings

SAME = "no change beyond the intervals"
BECAME = {
    "youngs_modulus": ("softened", "stiffened"),
    "damping_product": ("damps less", "damps more"),
}
BY_TIME, BY_NAME = "time of recording", "file name"


def drift(settings: Settings, band: str, root: Path | str = ".") -> dict:
    """Identify each recording of a band alone and hold them against each other.

    Writes reports/drift/<band>.png and .json; what is the same as in an earlier .json is taken
    from there.

    Returns:
        What the JSON says.

    Raises:
        UserError: An unknown band, fewer than two recordings, or one that cannot be used.
    """
    expect_known(settings, "band", band)
    layout = Layout(Path(root))
    files = once(layout.recordings(band))
    written = layout.root / "reports" / "drift" / f"{band}.json"
    if len(files) < 2:
        raise UserError(
            f"{layout.raw(band)}: holds {'one recording' if files else 'no recording'}, two or more"
            f" are needed; `sling add-recording --band {band} FILE.mcap` adds one"
        )
    expect_writable(written, written.with_suffix(".png"))
    description, sizes = environment("cpu", f"sling drift {band}"), settings.bands[band]
    band_sizes = Band(sizes.mass, sizes.diameter, sizes.rest_length, band, sizes.preconditioned)
    recordings = identified(files, band_sizes, settings, description["code"], written)
    dated = in_time(recordings)
    recordings = dated or recordings
    settled = [number for number, recording in enumerate(recordings) if recording.settled]
    for recording in recordings:
        if not recording.settled:
            print(
                f"warning: left out: the fit of {recording.file} had not settled", file=sys.stderr
            )
    if len(settled) < 2:
        raise UserError(f"{band}: fewer than two of the recordings could be fitted")
    values = {name: [recordings[i].values[name] for i in settled] for name in COMPARED}
    changed = [
        replace(change, earlier=settled[change.earlier], later=settled[change.later])
        for change in changes(values)
    ]
    deeper = _stretched_further(band_sizes, settings, recordings)
    new = max([newest(changed), *deeper])
    fresh = [
        layout.raw(band) / recording.file for recording in recordings[new:] if recording.settled
    ]
    verdict = [_changed(band, change, recordings, bool(dated)) for change in _first(changed)]
    verdict += [_softened(band, recordings, number, before) for number, before in deeper.items()]
    verdict = verdict or [SAME]
    content = description | {
        "band": band,
        "method": METHOD,
        "order": BY_TIME if dated else BY_NAME,
        "recordings": [
            recording.model_dump()
            | {"date": recording.date if dated else None, "new": bool(new) and i >= new}
            for i, recording in enumerate(recordings)
        ],
        "false_alarm": FALSE_ALARM,
        "changes": [asdict(change) for change in changed],
        "stretched_further": [{"later": i, "before_m": before} for i, before in deeper.items()],
        "verdict": verdict,
        "next": anew(band_sizes, fresh) if new and fresh else None,
    }
    titles = [
        f"{QUANTITIES[change.quantity].symbol} {_percent(change)}" for change in _first(changed)
    ]
    titles += ["stretched further"] * bool(deeper)
    title = f"{band}: {', '.join(titles or [SAME])}"
    over_time(written.with_suffix(".png"), recordings, bool(dated), changed, new, title)
    write_json(written, content)
    return content


def _first(changed: Sequence[ChangeOfBand]) -> list[ChangeOfBand]:
    """The surest of each quantity."""
    return [
        next(change for change in changed if change.quantity == name)
        for name in COMPARED
        if any(change.quantity == name for change in changed)
    ]


def _changed(
    band: str, change: ChangeOfBand, recordings: Sequence[IdentifiedRecording], dated: bool
) -> str:
    name, quantity = change.quantity, QUANTITIES[change.quantity]
    earlier, other = recordings[change.earlier], recordings[change.later]
    before, after = (f"on {each.date}" if dated else f"in {each.file}" for each in (earlier, other))
    return (
        f"{quantity.symbol} of {band} changed: {_interval(earlier, name)} {quantity.unit} {before},"
        f" {_interval(other, name)} {after}: {_percent(change)};"
        f" it {BECAME[name][change.ratio > 1]}"
    )


def _stretched_further(
    band: Band, settings: Settings, recordings: Sequence[IdentifiedRecording]
) -> dict[int, float]:
    """Numbers of recordings that stretch a band further than all before, and those' draw [m]."""
    result, before = {}, recordings[0].deepest
    for number, recording in enumerate(recordings):
        if number and further(band, settings.setup, before, recording.deepest):
            result[number] = before
        before = max(before, recording.deepest)
    return result


def _softened(
    band: str, recordings: Sequence[IdentifiedRecording], number: int, before: float
) -> str:
    recording = recordings[number]
    return (
        f"{recording.file} draws {band} to {recording.deepest:.3f} m, recordings before it to"
        f" {before:.3f} m at most: rubber softens up to its largest stretch, so take {band} as"
        " changed"
    )


def _percent(change: ChangeOfBand) -> str:
    return f"{100 * (change.ratio - 1):+.0f} %"


def _interval(recording: IdentifiedRecording, name: str) -> str:
    value, factor = recording.values[name], QUANTITIES[name].factor
    middle, low, high = (f"{factor * x:.3g}" for x in (value.value, value.low, value.high))
    return f"{middle} ({low} to {high})"


def anew(band: Band, files: Sequence[Path]) -> str:
    """The command that identifies the band by these recordings alone, under another name."""
    words = ["sling fit", *(file.as_posix() for file in files), f"--mass {band.mass:g}"]
    if band.diameter != DIAMETER:
        words.append(f"--diameter {band.diameter:g}")
    if band.rest_length != REST_LENGTH:
        words.append(f"--rest-length {band.rest_length:g}")
    return " ".join([*words, f"--name {band.name}_new"])


def shown(content: dict) -> str:
    """A table, and below it what came out."""
    dated = content["order"] == BY_TIME
    rows = [("recording", *(QUANTITIES[name].heading for name in COMPARED), "")]
    for row in content["recordings"]:
        recording = IdentifiedRecording.model_validate(row)
        left = "" if recording.settled else "not settled, left out"
        rows.append(
            (
                f"{recording.date}  {recording.file}" if dated else recording.file,
                *(_interval(recording, name) for name in COMPARED),
                left,
            )
        )
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    if not dated:
        lines.append("in the order of their names: their stamps are no wall clock's, or overlap")
    lines += ["", *content["verdict"]]
    if content["next"]:
        lines.append(f"identify it anew with the newer recordings: {content['next']}")
    return "\n".join([*lines, f"picture: reports/drift/{content['band']}.png"])
