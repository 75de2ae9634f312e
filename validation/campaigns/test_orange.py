"""A recording that this project did not make: does the identified band land where it was measured?

A band's folder, by the commands that a lab types. The landings are read after θ is written.
"""

import time

import numpy as np
import pytest

from sling2sim2real import Identification
from sling2sim2real.base.code import ROOT
from sling2sim2real.launching.trials.stretch import stretch_of
from validation.orange import ABOUT, NAME, landings
from validation.projects import SLING, ProjectCopy

pytestmark = pytest.mark.validation

RECORDINGS = ROOT.parent / "shared/recordings"
LIMIT = 0.05
LAB = "setup:\n  arm_stiffness: null\n"  # its note says where the hand was, not where it was sent


@pytest.mark.skipif(
    not (RECORDINGS / f"{NAME}_landings.csv").exists(),
    reason="the recording of the orange band is not beside the project",
)
def test_landings_are_predicted_within_the_recorded_stretch(tmp_path, progress, record) -> None:
    (tmp_path / "bands").mkdir()
    (tmp_path / "bands/lab.yaml").write_text(LAB)
    sizes = [f"--{name.replace('_', '-')}={ABOUT[name]}" for name in ("mass", "diameter")]
    recording, start = RECORDINGS / f"{NAME}.mcap", time.perf_counter()
    ProjectCopy(tmp_path)(*SLING, "fit", str(recording), "--name", NAME, *sizes)
    wall = time.perf_counter() - start
    found = Identification.load(tmp_path / "bands" / NAME)
    assert found.settings.setup.arm_stiffness is None

    draws, measured = landings(RECORDINGS)
    launched, setup = found.launches(draws), found.settings.setup
    error = launched.landing_y / measured - 1
    points = np.insert(draws, 0, 0, axis=1)
    inside = stretch_of(points, setup.fork_width, found.band.rest_length) <= found.stretch
    met = inside.any() and launched.failure == [None] * len(draws)
    met = bool(met and np.abs(error[inside]).mean() <= LIMIT)
    for name, part in (("inside", inside), ("beyond", ~inside)):
        progress(f"  {part.sum()} {name}: {100 * np.abs(error[part]).mean():.2f} %")
    record(
        "orange",
        requested="Identified from one recording by an independent engine and renderer (no robot),"
        " with the defaults of `sling fit`: the launches inside the recorded stretch are predicted"
        f" within {100 * LIMIT:g} % of distance on average. No landing is used for fitting.",
        met=met,
        settings={"band": ABOUT, "lab": LAB},
        figures={
            "theta": vars(found.theta),
            "draws_m": draws,
            "measured_m": measured,
            "error": error,
            "inside": inside,
            "failure": launched.failure,
            "recorded_stretch": found.stretch,
            "wall_seconds_to_theta": wall,
        },
    )
    assert met
