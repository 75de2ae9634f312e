"""Marginals and correlations, read back from the objects that were drawn."""

import numpy as np

from pipeline.drawing.styles import styles
from pipeline.report.figures import confidence
from tests.report.conftest import METHOD, THETA


def panels(kept) -> dict:
    return {ax.get_xlabel(): ax for ax in kept[0].axes}


def test_a_marginal_with_its_interval_and_the_mode(kept, result) -> None:
    confidence.marginals("", {METHOD: result}, styles([METHOD]))
    ax = panels(kept)["E [kPa]"]
    young = 1e-3 * THETA["youngs_modulus"]
    bar, dot = ax.lines[:2]
    np.testing.assert_allclose(bar.get_xdata(), [0.9 * young, 1.1 * young])
    np.testing.assert_allclose(dot.get_xdata(), young)
    stairs = ax.patches[0].get_data()
    np.testing.assert_allclose(stairs.edges[[0, -1]], [0.9 * young, 1.1 * young])
    assert stairs.values.max() == 1.0


def test_the_product_of_the_dampings_is_that_of_the_samples(kept, result) -> None:
    confidence.marginals("", {METHOD: result}, styles([METHOD]))
    stairs = panels(kept)["s·d [ms]"].patches[0].get_data()
    spread = np.array([0.9, 1.1]) ** 2
    span = 1e3 * THETA["damping_scale"] * THETA["elasticity_damping"] * spread
    np.testing.assert_allclose(stairs.edges[[0, -1]], span)


def test_correlations_are_written_into_their_cells(kept, result) -> None:
    confidence.correlation("", {METHOD: result}, styles([METHOD]))
    ax = kept[0].axes[0]
    texts = {tuple(map(int, text.get_position())): text.get_text() for text in ax.texts}
    assert len(texts) == 25
    assert texts[0, 1] == texts[1, 0] == "−0.90" and texts[0, 0] == "1" and texts[2, 0] == "0"
    assert [label.get_text() for label in ax.get_yticklabels()] == ["E", "ν", "d", "friction", "s"]
