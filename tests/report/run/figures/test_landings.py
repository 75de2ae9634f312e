"""Landings beside targets and predictions, read back from the objects that were drawn."""

import numpy as np
import pandas as pd

from pipeline.report.drawing.styles import styles
from pipeline.report.run.figures import landings
from tests.report.run.conftest import BAND, METHOD, launches

METHODS = [METHOD, "de"]
ERRORS = 100 * (np.array([1.725, 1.725, 1.925]) / [1.745, 1.695, 1.965] - 1)  # % of the three


def trials() -> pd.DataFrame:
    """Two methods on one band, the first also on another, where nothing lands."""
    far = launches().assign(band="far", landing_y=np.nan, failure="too far")
    return pd.concat([launches(), launches().assign(method="de", kind="virtual"), far])


def dots(ax) -> dict[int, list[float]]:
    """Places on the axis by row."""
    places = {}
    for collection in ax.collections:
        for x, y in (
            np.ma.getdata(collection.get_offsets()) if len(collection.get_offsets()) else ()
        ):
            if collection.get_paths() and hasattr(collection, "get_sizes"):
                places.setdefault(round(y), []).append(x)
    return places


def words(figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_every_launch_lies_as_far_off_as_it_landed(retained) -> None:
    landings.misses("", trials(), {BAND: 0.02}, styles(METHODS))
    first, second = retained[0].axes
    places = dots(first)
    assert sorted(places) == [0, 1]
    for row in places.values():
        np.testing.assert_allclose(sorted(row), [-3, 2, 4])
    assert dots(second) == {} and [t.get_text() for t in second.texts] == ["4 of 4 failed"]
    assert [t.get_text() for t in first.texts] == ["1 of 4 failed"] * 2
    (floor,) = first.patches
    np.testing.assert_allclose([floor.get_x(), floor.get_width()], [-2, 4])
    names = [label.get_text() for label in first.get_yticklabels()]
    assert names == ["Sling2Sim2Real", "DE_L"]
    assert {"measured (hollow)", "aimed at 1.725 m"} <= set(words(retained[0]))


def test_a_landing_outside_the_area_is_a_failure_and_no_dot(retained) -> None:
    outside = launches().assign(landing_y=[1.745, 1.0, 1.965, 2.6])
    landings.misses("", outside, {}, styles([METHOD]))
    (ax,) = retained[0].axes
    np.testing.assert_allclose(sorted(dots(ax)[0]), [2, 4])
    assert [text.get_text() for text in ax.texts] == ["2 of 4 failed"]
    assert not any("floor" in word for word in words(retained[0]))


def test_what_is_far_off_lies_on_a_logarithmic_axis_that_says_so(retained) -> None:
    for off, words in ((0.05, ""), (0.2, ", logarithmic beyond ± 10")):
        trials = launches()
        landings.misses("", trials.assign(landing_y=trials.target + off), {}, styles([METHOD]))
        assert retained[-1].axes[0].get_xlabel() == f"landing − target [cm]{words}"


def test_predictions_lie_in_intervals_that_are_called_what_they_are(retained) -> None:
    landings.predictions("", trials(), {(BAND, METHOD)}, styles(METHODS))
    (ax,) = retained[0].axes  # nothing landed on the other band
    for row in dots(ax).values():
        np.testing.assert_allclose(sorted(row), sorted(ERRORS))
    lines = [collection for collection in ax.collections if hasattr(collection, "get_segments")]
    solid, dotted = (line.get_linestyle()[0][1] for line in lines)
    assert solid is None and dotted is not None
    ends = np.array([segment[:, 0] for segment in lines[0].get_segments()])
    widths = 100 * 0.05 / np.array([1.695, 1.745, 1.965])
    np.testing.assert_allclose(ends[:, 1] - ends[:, 0], widths)
    assert {"90 % interval", "90 % by the draw's error alone"} <= set(words(retained[0]))
    landings.predictions("", launches(), {(BAND, METHOD)}, styles([METHOD]))
    assert "90 % by the draw's error alone" not in words(retained[1])


def test_launches_without_intervals_are_drawn_too(retained) -> None:
    bare = launches().assign(predicted_low=np.nan, predicted_high=np.nan)
    landings.predictions("", bare, {(BAND, METHOD)}, styles([METHOD]))
    assert not any("90 %" in word for word in words(retained[0]))
    np.testing.assert_allclose(sorted(dots(retained[0].axes[0])[0]), sorted(ERRORS))
