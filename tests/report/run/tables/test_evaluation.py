"""Hits within the bullseye, counted by hand."""

from pipeline.report.drawing.styles import styles
from pipeline.report.run.results import Results
from pipeline.report.run.tables import evaluation
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
