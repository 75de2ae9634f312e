"""Pictures of the searches, read back from the objects that were drawn."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Ellipse

from pipeline.report.drawing.styles import styles
from pipeline.report.run.figures import search
from tests.report.run.conftest import BAND, METHOD


def pairs(figure: plt.Figure) -> list[plt.Axes]:
    return [ax for ax in figure.axes if ax.get_xlim() == ax.get_ylim() == (0, 1)]


def test_convergence_draws_the_printed_loss_of_the_best_so_far(retained, result) -> None:
    """Of a fit that keeps one row, that row stands where its rollouts end."""
    fitted = replace(result, theta=result.theta | {"rollouts": 60})
    search.convergence("", {BAND: {METHOD: result, "de": fitted}}, styles([METHOD, "de"]))
    (ax,) = retained[0].axes
    steps, end, other, _ = ax.lines
    assert steps.get_xdata().tolist() == [1, 2, 3, 4, 5]
    assert other.get_xdata().tolist() == [1, 2, 3, 4, 60]
    for line in (steps, other):
        np.testing.assert_allclose(line.get_ydata(), [3, 3, 2, 2, 1.25])
    assert end.get_xydata().tolist() == [[5, 1.25]]
    assert steps.get_linestyle() != other.get_linestyle()


def test_the_corner_shows_every_pair_of_parameters(retained, result, params) -> None:
    search.corner("", result, params.parameters, "x")
    assert len(pairs(retained[0])) == 5 * 4 / 2
    for ax in pairs(retained[0]):
        points = ax.collections[0].get_offsets()
        assert len(points) == 4  # the failed one is a cross
        crosses = [line for line in ax.lines if line.get_marker() == "x"]
        np.testing.assert_allclose(crosses[0].get_xdata(), [0.5])
        star = next(line for line in ax.lines if line.get_marker() == "*")
        np.testing.assert_allclose([star.get_xdata()[0], star.get_ydata()[0]], 0.75)
        (ellipse,) = (patch for patch in ax.patches if isinstance(patch, Ellipse))
        np.testing.assert_allclose(ellipse.center, 0.4)
        np.testing.assert_allclose([ellipse.width, ellipse.height], 0.2)  # twice a deviation
        way = next(line for line in ax.lines if line.get_color() == search.PATH)
        np.testing.assert_allclose(way.get_xdata(), [0.4, 0.25, 0.75])  # centre, two iterations


def test_an_ellipse_lies_along_its_covariance(retained, result, params) -> None:
    sigma = 0.01 * np.eye(5)
    sigma[0, 1] = sigma[1, 0] = 0.009
    result.regions[0].sigma[:] = sigma
    search.corner("", result, params.parameters, "x")
    first = pairs(retained[0])[0]
    (ellipse,) = (patch for patch in first.patches if isinstance(patch, Ellipse))
    assert ellipse.angle % 180 == pytest.approx(45)
    assert ellipse.width == pytest.approx(2 * np.sqrt(0.019))
    assert ellipse.height == pytest.approx(2 * np.sqrt(0.001))


def test_axes_that_are_held_fixed_are_left_out(retained, result, params) -> None:
    for name in ("poissons_ratio", "elasticity_damping", "damping_scale"):
        result.evaluations[f"unit_{name}"] = 0.5
    search.corner("", result, params.parameters, "x")
    assert len(pairs(retained[0])) == 1


def test_ticks_stand_at_round_physical_values(retained, result, params) -> None:
    search.corner("", result, params.parameters, "x")
    ax = next(ax for ax in retained[0].axes if ax.get_xlabel() == "d [ms]")
    box = params.parameters.elasticity_damping
    for place, label in zip(ax.get_xticks(), ax.get_xticklabels(), strict=True):
        seconds = box.low * (box.high / box.low) ** place
        assert 1e3 * seconds == pytest.approx(float(label.get_text()))
    assert [label.get_text() for label in ax.get_xticklabels()] == ["1", "10"]
