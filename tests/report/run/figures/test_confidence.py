"""Correlations, read back from the objects that were drawn."""

import numpy as np

from pipeline.report.quantities import coordinate
from pipeline.report.run.figures import confidence
from tests.report.run.conftest import BAND, METHOD


def test_correlations_are_written_into_half_of_their_cells(retained, result) -> None:
    confidence.correlation("", {BAND: result.confidence, "other": result.confidence})
    first, second, _ = retained[0].axes
    assert (first.get_title(), second.get_title()) == (BAND, "other")
    (image,) = first.images
    np.testing.assert_array_equal(image.get_array(), result.confidence["correlation"]["matrix"])
    assert [(t.get_position(), t.get_text()) for t in first.texts] == [((0, 1), "−0.9")]
    assert METHOD not in first.get_title()


def test_coordinates_have_words() -> None:
    names = "log_youngs_modulus", "mooney_share", "log_loss_factor"
    words = ["log E", "Mooney share", "log loss factor"]
    assert [coordinate(name) for name in names] == words
