"""Hanging lengths by a law that can be solved by hand."""

import numpy as np
import pytest

from pipeline.base.weight import READINGS, tension
from pipeline.report.run.hanging import hanging_stretch
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import Parameters


def test_a_band_hangs_as_its_law_says(params) -> None:
    band = ClampedBand.of(params.bands["band1"], params.setup, params.sling)
    stiff, soft = (
        Parameters.of("neo_hookean", np.array([young, 0.45, 1e-3, 0.5, 0.5])) for young in (3e5, 10)
    )
    for strands in READINGS:
        stretch = hanging_stretch(band, stiff, strands)
        assert 1e5 * (stretch - stretch**-2) * band.area == pytest.approx(tension(strands))
        assert np.isnan(hanging_stretch(band, soft, strands))
