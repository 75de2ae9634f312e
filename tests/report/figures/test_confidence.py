"""Profile curves and correlations, read back from the objects that were drawn."""

import numpy as np
import pytest

from pipeline.report.figures import confidence
from pipeline.report.styles import styles
from tests.report import conftest
from tests.report.conftest import METHOD, THETA


def test_a_profile_a_parameter_and_its_interval(kept, result, params) -> None:
    confidence.profiles("", {METHOD: result}, styles([METHOD]), params.parameters)
    axes = {ax.get_xlabel(): ax for ax in kept[0].axes}
    assert list(axes)[:5] == ["E [MPa]", "ν", "d [ms]", "friction", "s"]
    d = 1e3 * THETA["elasticity_damping"]
    curve, bar, dot = axes["d [ms]"].lines[:3]
    assert curve.get_ydata().min() == 0 and curve.get_xdata()[20] == pytest.approx(d)
    np.testing.assert_allclose(bar.get_xdata(), [0.9 * d, 1.1 * d])
    np.testing.assert_allclose(dot.get_xdata(), d)
    level = axes["d [ms]"].lines[-1].get_ydata()[0]
    assert level == pytest.approx(2.7055, abs=1e-3)  # 90 % of chi square with one degree
    np.testing.assert_allclose(np.interp(0.9 * d, curve.get_xdata(), curve.get_ydata()), 2.71)
    assert "not identifiable" in axes["friction"].texts[0].get_text()
    assert axes["ν"].texts[0].get_text() == ""


def test_a_fixed_parameter_has_no_curve(kept, result, params) -> None:
    result.theta["confidence"] = conftest.confidence(fixed="damping_scale")
    del result.posterior["profiles"]["damping_scale"]
    confidence.profiles("", {METHOD: result}, styles([METHOD]), params.parameters)
    ax = next(ax for ax in kept[0].axes if ax.get_xlabel() == "s")
    assert "held fixed" in ax.texts[0].get_text() and len(ax.lines) == 2
    assert ax.lines[0].get_xdata()[0] == THETA["damping_scale"]


def test_the_product_of_the_dampings_is_that_of_the_samples(kept, result, params) -> None:
    confidence.profiles("", {METHOD: result}, styles([METHOD]), params.parameters)
    stairs = kept[0].axes[5].patches[0].get_data()
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
