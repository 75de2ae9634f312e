"""Training and landing maps, read back from the objects that were drawn."""

import numpy as np

from pipeline.report.drawing.styles import styles
from pipeline.report.run.figures import policy
from tests.report.run.conftest import BAND, METHOD


def test_the_map_shows_the_path_of_the_policy_and_what_lies_about_it(retained, result) -> None:
    targets, path = np.array([1.725, 2.125]), np.array([[-0.30, -0.14], [-0.34, -0.13]])
    chart, other = result.landing_map, "other"
    policy.landing_maps(
        "", {BAND: chart, other: chart}, {BAND: path, other: path}, targets,
        {BAND: 1.63, other: 1.63}, 0.275, {BAND: 0.52, other: 0.52},
    )  # fmt: skip
    first, _, bar = retained[0].axes
    line, dot = first.lines
    np.testing.assert_array_equal(np.transpose(line.get_data()), path)
    np.testing.assert_array_equal([dot.get_xdata()[0], dot.get_ydata()[0]], path[0])
    low, high = first.get_xlim()
    assert max(chart.draw_y[0], -0.34 - policy.AROUND) == low and high < 0
    y, z, landing = policy._fine(chart, path.min(0) - policy.AROUND, path.max(0) + policy.AROUND)
    assert bar.get_ylim()[0] <= np.nanmin(landing) and np.nanmax(landing) <= bar.get_ylim()[1]
    np.testing.assert_allclose(landing[3, 5], chart(np.array([[y[3, 5], z[3, 5]]])).landing_y[0])


def test_training_is_drawn_in_centimetres(retained, result) -> None:
    curves = {BAND: {METHOD: result.training, "de": result.training}}
    policy.training("", curves, styles([METHOD, "de"]))
    first, second, _ = retained[0].axes[0].lines
    np.testing.assert_array_equal(first.get_xdata(), [1, 2])
    np.testing.assert_allclose(first.get_ydata(), [30, 0.4])
    assert first.get_linestyle() != second.get_linestyle()
