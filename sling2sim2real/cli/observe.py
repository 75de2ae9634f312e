"""`sling observe`: a measured launch goes into launches.csv, and the band is fitted again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

import numpy as np

from sling2sim2real.api.band_folder import BandFolder
from sling2sim2real.api.identification import METHOD, Identification
from sling2sim2real.api.launching import Hazard, launch
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.launches_file import FIT, LaunchRow, write_launches
from sling2sim2real.cli.aim import tell
from sling2sim2real.cli.fit import fit
from sling2sim2real.simulator.rubber import RUBBER

# Of a stretch. Up to this much further, the law rubber (simulator/rubber.py) moves the force at the
# old largest stretch by 3 % of the softening at most.
FURTHER = 0.01


def observe(folder: BandFolder, row: LaunchRow, *, again: bool = False) -> dict:
    """Append a launch, fit again and make the card again.

    Args:
        again: Whether one that equals another is one more launch, instead of a mistake.

    Returns:
        `file`, `launches` in it, `measured_m`, `measured_speed` [m/s], `measured_angle` [degrees],
        what was predicted `before` and is `after`, and `warnings`, which are printed on stderr
        before the fit.

    Raises:
        UserError: It can be no launch, or is known already, and nothing is written; or a step
            fails, and the launch stays: the same command goes on.
    """
    floor = -folder.settings.setup.fork_height
    if row.draw[1] <= floor:
        raise UserError(f"--draw: z = {row.draw[1]:g} m lies below the floor, z = {floor:g} m")
    if row.landing is None and (row.speed is None or row.use != FIT):
        raise UserError("--landing: is missing; only a launch to fit may have its --speed alone")
    before = Identification.load(folder.path) if folder.theta.is_file() else None
    known = any(row.equals(other) for other in folder.launches)
    if known and not again and before and not before.stale:
        raise UserError(
            f"{folder.launches_file}: this launch is there already; if you measured one more that"
            " is equal, add --again"
        )
    first = _prediction(before, row)
    if known and not again:
        print(f"{folder.launches_file} has this launch: the fit goes on")
        rows = folder.launches
    else:
        rows = [*folder.launches, row]
        write_launches(folder.launches_file, rows)
    doubts = [*_doubted(first, row, folder), *_softened(before, row, folder)]
    tell(doubts)
    fit(BandFolder(folder.path))
    after = _prediction(Identification.load(folder.path), row)
    if after and after["failure"]:
        doubts.append(Hazard("failure", f"the launch fails in simulation: {after['failure']}"))
        tell(doubts[-1:])
    return {
        "file": str(folder.launches_file),
        "launches": len(rows),
        "use": row.use,
        "measured_m": row.landing,
        "measured_speed": row.speed,
        "measured_angle": row.angle,
        "before": first,
        "after": after,
        "warnings": [asdict(doubt) for doubt in doubts],
    }


def _prediction(found: Identification | None, row: LaunchRow) -> dict | None:
    """What is predicted of the launch's draw, and the share of energy that launches return."""
    if found is None:
        return None
    launched = launch(found, row.draw, error=row.error)
    share = found.intervals.get("returned_share")
    return {
        "landing_m": None if launched.failure else launched.landing,
        "interval_90_m": launched.interval_90 and list(launched.interval_90),
        "speed": None if launched.failure else launched.speed,
        "angle": None if launched.failure else float(np.rad2deg(launched.angle)),
        "failure": launched.failure,
        "returned_share": found.theta.returned_share,
        "share_90": share and [share.low, share.high],
    }


def _doubted(before: dict | None, row: LaunchRow, folder: BandFolder) -> Iterator[Hazard]:
    """A landing outside the interval that was predicted."""
    if row.landing is None or before is None or before["interval_90_m"] is None:
        return
    low, high = before["interval_90_m"]
    if not low <= row.landing <= high:
        yield Hazard(
            "miss",
            f"{row.landing:g} m lies outside the predicted interval, {low:.3f} to {high:.3f} m: if"
            f" draw or landing was mistaken, correct its line in {folder.launches_file} and fit"
            " again",
        )


def _softened(found: Identification | None, row: LaunchRow, folder: BandFolder) -> Iterator[Hazard]:
    """A draw that stretched the band further than all before it: rubber softens."""
    if found is None or row.use != FIT or found.stretch is None:
        return
    width, band = found.settings.setup.fork_width, found.band

    def stretch(draw: float) -> float:
        return 2 * float(np.hypot(width / 2, draw)) / band.rest_length

    draws = [float(np.hypot(*launch.draw)) for launch in folder.launches]
    if band.preconditioned is True:
        return
    most = max([found.stretch, stretch(band.preconditioned), *map(stretch, draws)])
    drawn = float(np.hypot(*row.draw))
    if stretch(drawn) <= most + FURTHER:
        return
    method = found.settings.methods[METHOD]
    note = "launches after it count as of the softened band"
    if method.law != RUBBER or method.fixed.get("softening") == 0:
        note = "the law leaves that out, a new recording tells by how much"
    yield Hazard(
        "stretch",
        f"this launch drew {band.name} to {drawn:.3f} m, further than ever: rubber softens up to"
        f" its largest stretch; {note}",
    )


def shown(answer: dict) -> str:
    """A few lines for people."""
    count = answer["launches"]
    lines = [f"{answer['file']}: {count} launch{'' if count == 1 else 'es'}"]
    for when in ("before", "after"):
        if note := answer[when]:
            share = _with_ends(note["returned_share"], note["share_90"], "")
            landed = note["failure"] and f"fails in simulation: {note['failure']}"
            landed = landed or _flown(note["landing_m"], note["interval_90_m"], note)
            lines.append(f"{when:8}  landing {landed}, returned share {share}")
    told = {"speed": answer["measured_speed"], "angle": answer["measured_angle"]}
    lines.append(f"measured  {_flown(answer['measured_m'], None, told)}")
    return "\n".join(lines)


def _flown(landing: float | None, ends: list[float] | None, left: dict) -> str:
    """A landing with its interval [m], and speed [m/s] and angle [degrees] with which it left."""
    parts = [] if landing is None else [_with_ends(landing, ends, " m")]
    parts += [f"{left['speed']:.2f} m/s"] if left["speed"] is not None else []
    parts += [f"{left['angle']:.1f} degrees"] if left["angle"] is not None else []
    return ", ".join(parts)


def _with_ends(value: float, ends: list[float] | None, unit: str) -> str:
    note = "" if ends is None else f" (90 %: {ends[0]:.3f} to {ends[1]:.3f}{unit})"
    return f"{value:.3f}{unit}{note}"
