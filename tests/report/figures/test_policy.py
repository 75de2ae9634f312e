"""Landings beside predictions, read back from the objects that were drawn."""

import numpy as np
import pandas as pd

from pipeline.drawing.styles import styles
from pipeline.report.figures import policy
from tests.report.conftest import METHOD, launches


def test_every_method_has_a_row_and_two_have_intervals(kept) -> None:
    methods = [METHOD, "de", "bo"]
    trials = pd.concat([launches().assign(method=method) for method in methods])
    policy.landings("", trials, styles(methods), methods[:2])
    left, right = kept[0].axes
    bars = [line for line in left.lines if len(set(line.get_xdata())) == 1]
    assert len(bars) == 2 * 3  # the fourth did not land
    np.testing.assert_allclose(bars[0].get_ydata(), [1.7, 1.75])
    rows = {}
    for dots in right.collections:
        for error, row in dots.get_offsets():
            rows.setdefault(row, []).append(error)
    assert sorted(rows) == [0, 1, 2]
    expected = 100 * (np.array([1.725, 1.725, 1.925]) / [1.745, 1.695, 1.965] - 1)
    np.testing.assert_allclose(sorted(rows[2]), sorted(expected))
    assert [label.get_text() for label in right.get_yticklabels()][1:] == ["DE_L", "BO_L"]


def test_launches_without_intervals_are_drawn_too(kept) -> None:
    trials = launches().assign(predicted_low=np.nan, predicted_high=np.nan)
    policy.landings("", trials, styles([METHOD]), [METHOD])
    assert "90 % interval" not in [text.get_text() for text in kept[0].legends[0].get_texts()]


def test_the_map_shows_the_path_of_the_policy(kept, result) -> None:
    targets, near = np.array([1.725, 2.125]), np.array([[-0.30, -0.14], [-0.34, -0.13]])
    policy.landing_map("", result, near, targets, 1.63, 0.275, 0.52)
    ax, bar = kept[0].axes
    (path,) = [line for line in ax.lines if line.get_label().endswith("far target")]
    np.testing.assert_array_equal(np.transpose(path.get_data()), near)
    (first,) = [line for line in ax.lines if line.get_marker() == "o"]
    np.testing.assert_array_equal([first.get_xdata()[0], first.get_ydata()[0]], near[0])
    assert bar.get_ylim()[1] <= policy.REACH * 2.125 + 0.5  # colours tell the targets apart


def test_training_is_drawn_in_centimetres(kept, result) -> None:
    policy.training("", {METHOD: result, "de": result}, styles([METHOD, "de"]))
    curve = kept[0].axes[0].lines[0]
    np.testing.assert_array_equal(curve.get_xdata(), [1, 2])
    np.testing.assert_allclose(curve.get_ydata(), [30, 0.4])
