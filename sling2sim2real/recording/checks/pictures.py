"""What the pictures show of the band, phase by phase."""

from __future__ import annotations

from collections.abc import Iterator

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.coverage import PictureLine, by_phase
from sling2sim2real.recording.processed import Processed

COVERAGE = {"hanging": 0.7, "drawn": 0.9, "recoil": 0.6, "swing": 0.7}
EMPTY = 0.05  # share of the pictures
FOREIGN = 0.02  # share of a picture's points
SEEN_AS = {"hanging": "hangs", "drawn": "is drawn", "recoil": "recoils", "swing": "swings"}
LOOK = "look at --sheet; nearer camera, more light, another background, or cloud.mask folder"

DRAWN = Check(
    "drawn",
    "the way from tip to hand to tip with the band's rest length",
    "none that matters",
    "",
    "no picture shows the drawn band",
    "check the rest length, or record a longer pull",
)
COVERED = Check(
    "coverage",
    "the band's points with where the band must be",
    "a band's thickness; the mean of many pictures",
    ", ".join(f"{100 * least:g} % while it {SEEN_AS[name]}" for name, least in COVERAGE.items()),
    "no band is found in any picture",
    LOOK,
)
UNSEEN = Check(
    "unseen",
    "the pictures' times with the phases of the pull",
    "none that matters",
    "a phase is in no picture",
    "",
    "record the camera from before the grasp until it has swung",
)
OFF_PLANE = Check(
    "off_plane",
    "points of the hanging band with the plane that it hangs in",
    "16 mm at most on sound recordings; warned from 20 mm",
    f"{100 * FOREIGN:g} % of a picture's points are off it",
    "",
    LOOK,
)
NO_BAND = Check(
    "empty",
    "pictures with those that show the band",
    "none: they are counted",
    f"{100 * EMPTY:g} % show none",
    "none shows it",
    LOOK,
)
DAMAGED = Check(
    "damaged",
    "pictures, colour and depth, with those that can be decoded",
    "none: they are counted",
    f"{100 * EMPTY:g} % cannot be",
    "none can be",
    "see whether the camera's driver sends empty ones",
)
UNPAIRED = Check(
    "unpaired",
    "depth pictures with colour pictures within half a period",
    "none: stamps are exact",
    f"{100 * EMPTY:g} % have none",
    "none has one",
    "record both at one rate, with reliable QoS",
)
CHECKS = (DRAWN, COVERED, UNSEEN, OFF_PLANE, NO_BAND, DAMAGED, UNPAIRED)


def findings(done: Processed) -> Iterator[Finding]:
    clouds, frames = done.clouds, len(done.clouds.points)
    if done.taut_coverage[0] is None:
        length = done.band.rest_length
        what = f"no picture shows the band drawn taut at a rest length of {length:g} m"
        yield DRAWN.found(what, refused=True)
        return
    yield from of_coverage(done.coverage)
    colors, cannot = clouds.damaged_colors, "cannot be decoded"
    for check, count, what in (
        (NO_BAND, clouds.empty, f"{clouds.empty} of {frames} pictures show no band"),
        (DAMAGED, clouds.damaged - colors, f"{clouds.damaged - colors} depth pictures {cannot}"),
        (DAMAGED, colors, f"{colors} colour pictures {cannot}"),
        (UNPAIRED, clouds.unpaired, f"{clouds.unpaired} depth pictures have no colour picture"),
    ):
        if count > EMPTY * frames:
            yield check.found(what)


def of_coverage(rows: list[PictureLine]) -> Iterator[Finding]:
    """Findings from the rows of all pictures."""
    phases = by_phase(rows)
    for row in phases:
        if row.coverage < COVERAGE.get(row.phase, 0.0):
            yield COVERED.found(
                f"{100 * row.coverage:.0f} % of the band is covered while it"
                f" {SEEN_AS[row.phase]} ({row.start:.2f} - {row.end:.2f} s)"
            )
    shown = {row.phase for row in phases}
    for phase in (phase for phase in SEEN_AS if phase not in shown):
        yield UNSEEN.found(f"no picture shows how the band {SEEN_AS[phase]}")
    measured = [(row.time, row.off_plane) for row in rows if row.off_plane is not None]
    foreign = [time for time, off_plane in measured if off_plane > FOREIGN]
    if foreign:
        times = f"{foreign[0]:.2f} - {foreign[-1]:.2f} s"
        yield OFF_PLANE.found(
            f"{len(foreign)} of {len(measured)} pictures of the hanging band hold points off the"
            f" plane that it hangs in ({times}): the hand, the arm or the background"
        )
