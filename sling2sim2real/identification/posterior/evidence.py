"""Launches that are evidence: data/evidence/<band>.csv, which `sling observe` writes.

Columns draw_y_m, draw_z_m, draw_error_m, landing_y_m. A launch is evidence or a score
(data/trials/measured/), never both. The stage `evidence` checks them, and the density reads what it
writes: {"launches": [{"draw", "error", "landing"}, ...], "setup": {...}}; "setup" is what launches
them (a LaunchSetup) and missing where there is no launch; "made_with" its keys in params.yaml.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from sling2sim2real.base import launch_table as table
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from sling2sim2real.base.schema import LIST, JsonRecord, read_json
from sling2sim2real.identification.posterior.launches import Evidence, Observed
from sling2sim2real.settings import Settings
from sling2sim2real.settings.provenance import evidence_settings_of
from sling2sim2real.simulator.model import LaunchSetup

COLUMNS = (*table.DRAW, "draw_error_m", table.LANDING)  # as they are written
MOST_ERROR = 0.1  # of a draw [m]


def read_evidence(folder: Path, band: str, params: Settings) -> list[Observed]:
    """Read the launches of a band, oldest first; none where it has no file.

    A draw without an error of its own has that of a commanded one, `trials.actuation_error`.

    Raises:
        UserError: A file is no band's, cannot be read, or says what no launch can have done.
    """
    path = table.file_of(folder, band, params.bands)
    return read_launches(path, params.trials.actuation_error) if path else []


def read_launches(path: Path, error: float | None) -> list[Observed]:
    """Read the launches of a CSV with `COLUMNS`, of which the error may be missing.

    Args:
        error: Of a draw without one of its own [m].

    Raises:
        UserError: It cannot be read, or says what no launch can have done.
    """
    launches = []
    for row in table.rows(path, "evidence"):
        where, draw_error = row.where, row.cells["draw_error_m"]
        if row.landing is None:
            raise UserError(f"{where}: a launch that did not land is no evidence, leave it out")
        draw_error = (
            expect_error(where, table.number(where, "draw_error_m", draw_error))
            if draw_error
            else error
        )
        launches.append(Observed(row.draw, draw_error, row.landing))
    return launches


class LaunchRecord(JsonRecord):
    draw: Annotated[tuple[float, float], LIST]
    error: float
    landing: float


class SetupRecord(JsonRecord):
    projectile_mass: float
    fork_height: float
    foot_height: float
    arm_stiffness: float | None
    step: float
    duration: float


class ObservedFile(JsonRecord):
    launches: list[LaunchRecord]
    setup: SetupRecord | None = None
    made_with: dict[str, float | None] = {}


def save_observed(path: Path, launches: Sequence[Observed], params: Settings) -> None:
    """Write an `ObservedFile`; without launches it is the same whatever the lab is."""
    content: dict = {"launches": [vars(launch) for launch in launches]}
    if launches:
        setup = vars(LaunchSetup.of(params.setup, params.sling))
        content["setup"] = {name: setup[name] for name in SetupRecord.model_fields}
        content["made_with"] = evidence_settings_of(params)
    write_json(path, content)


def load_observed(path: Path) -> Evidence | None:
    """What an `ObservedFile` holds, None without launches. Raises NotMade."""
    read = read_json(path, ObservedFile)
    if not read.launches or read.setup is None:
        return None
    launches = [Observed(launch.draw, launch.error, launch.landing) for launch in read.launches]
    setup = {name: getattr(read.setup, name) for name in SetupRecord.model_fields}
    return Evidence(launches, LaunchSetup(**setup), read.made_with)


def expect_error(where: str, error: float) -> float:
    """A draw's standard deviation [m], if it can be one. Raises UserError."""
    if not 0 <= error < MOST_ERROR:
        raise UserError(
            f"{where}: draw_error_m must be at least 0 and below {MOST_ERROR:g} m, got {error:g}"
        )
    return error
