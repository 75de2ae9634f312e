"""Bullseye, slopes of landings and hanging lengths, counted by hand."""

import numpy as np
import pytest

from pipeline.base.weight import READINGS, tension
from pipeline.report.drawing.styles import styles
from pipeline.report.run.results import Results
from pipeline.report.run.tables import evaluation
from pipeline.report.run.tables.evaluation import Hanging
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import Parameters
from tests.report.run.conftest import BAND, METHOD

NAMED = styles([METHOD])


def test_a_launch_that_misses_the_bullseye_or_fails_is_no_hit(results: Results, result) -> None:
    far = result.trials.copy()
    far.loc[0, "landing_y"] = 1.725 + evaluation.BULLSEYE + 0.01
    result.trials[:] = far
    table = evaluation.bullseye(Results(results.episodes, {BAND: {METHOD: result}}, {}), NAMED)
    assert table is not None
    assert table[1] == [
        [BAND, "Sling2Sim2Real", "measured", "1 of 2", "1 of 1", "0 of 1", "2 of 4 (50 %)"]
    ]


def test_the_slope_is_that_of_the_map(result) -> None:
    draw = np.array([[-0.3, -0.14]])
    step = 1e-4 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    land = result.landing_map(draw + step).landing_y
    slope = np.hypot(land[0] - land[1], land[2] - land[3]) / 2e-4
    assert evaluation.steepness(result, draw)[0] == pytest.approx(slope, rel=1e-2)


def test_a_band_hangs_as_its_law_says(params) -> None:
    """By a law that can be solved by hand."""
    band = ClampedBand.of(params.bands["band1"], params.setup, params.sling)
    stiff, soft = (
        Parameters.of("neo_hookean", np.array([young, 0.45, 1e-3, 0.5, 0.5])) for young in (3e5, 10)
    )
    for strands in READINGS:
        stretch = evaluation.hanging_stretch(band, stiff, strands)
        assert 1e5 * (stretch - stretch**-2) * band.area == pytest.approx(tension(strands))
        assert np.isnan(evaluation.hanging_stretch(band, soft, strands))


def test_hanging_lengths_stand_beside_the_rigs() -> None:
    rows = [
        Hanging(BAND, None, 0.26, {2: 0.40, 1: np.nan}, 1.6),
        Hanging(BAND, METHOD, 0.26, {2: 0.44, 1: 0.5}, 1.6),
    ]
    _, (true, identified) = evaluation.hanging_table(rows, NAMED)
    assert true[1:] == ["the rig's rubber", "26", "40.0", "not held"]
    assert identified[1:] == ["Sling2Sim2Real", "26", "44.0* (+10 %)", "50.0*"]
