"""Pictures of the report, read back from the objects that were drawn."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

from pipeline.report.data import with_errors
from pipeline.report.figures import landings
from sling2sim2real.drawing import canvas
from sling2sim2real.drawing.styles import styles
from tests.report.conftest import BAND, METHOD, launches


@pytest.fixture
def retained(monkeypatch) -> list[plt.Figure]:
    """Figures that were drawn, in place of their files."""
    figures: list[plt.Figure] = []
    monkeypatch.setattr(canvas, "save", lambda figure, *_: figures.append(figure))
    yield figures
    plt.close("all")


METHODS = [METHOD, "de"]


def trials() -> pd.DataFrame:
    """Two methods on one band, the first also on another, where nothing lands."""
    far = launches().assign(band="far", landing_y=np.nan, failure="too far")
    both = launches(), launches().assign(method="de", kind="virtual")
    return with_errors(pd.concat([*both, far]))


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
    assert names == ["paper", "DE_L"]
    assert {"measured (hollow)", "aimed at 1.725 m"} <= set(words(retained[0]))


def test_flights_lie_where_they_flew_and_were_expected(retained, params) -> None:
    """A launch without air from 0.5 m above the floor, at 45 degrees and 3 m/s."""
    flown = {"flight_y": [[0.0, 1.0, 2.0]] * 4, "flight_z": [[0.0, 0.4, -0.5]] * 4}
    begun = {"predicted_leave_y": 0.0, "predicted_leave_z": 0.0, "predicted_speed": 3.0}
    trials = launches().assign(kind="virtual", predicted_angle=np.pi / 4, **begun, **flown)
    trials.loc[3, "flight_y"] = None
    landings.flights("", with_errors(trials), params.setup, styles([METHOD]))
    (ax,) = retained[0].axes
    curves = [line for line in ax.lines if len(line.get_xdata()) == 3]
    assert len(curves) == 3 and ax.get_title() == "paper (3 of 4 flew)"
    np.testing.assert_array_equal(curves[0].get_xydata(), np.transpose([[0, 1, 2], [0, 0.4, -0.5]]))
    expected = next(line for line in ax.lines if line.get_linestyle() == "--")
    far = expected.get_xydata()[-1]
    speed, height = 3 / np.sqrt(2), params.setup.fork_height
    time = (speed + np.sqrt(speed**2 + 2 * 9.81 * height)) / 9.81
    np.testing.assert_allclose(far, [speed * time, -height], rtol=1e-3)
