"""Flights and landings, read back from the objects that were drawn."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Circle
from scipy.integrate import solve_ivp

from pipeline.drawing.styles import styles
from pipeline.report.figures import launches as drawing
from pipeline.sling.model import GRAVITY
from tests.report.conftest import BAND, METHOD, launches

FLOOR = -0.52
LEAVE = {"leave_y": -0.2, "leave_z": -0.08, "speed": 4.3, "angle": 0.4}


@pytest.fixture
def results(results):
    """Two virtual launches at each of two targets; the last one failed and has no flight."""
    one = drawing.flight(*LEAVE.values(), FLOOR)
    trials = launches().assign(
        kind="virtual",
        target=[1.725, 1.725, 1.925, 1.925],
        trial=[1, 2, 1, 2],
        landing_y=[1.70, 1.76, 1.93, None],
        failure=[None, None, None, "hits the fork"],
        flight_y=[one[:, 0] + off for off in (-0.02, 0.04, 0.21)] + [None],
        flight_z=[one[:, 1]] * 3 + [None],
        **{f"predicted_{name}": [value] * 2 + [None] * 2 for name, value in LEAVE.items()},
    )
    of_band = results.methods[BAND]
    of_band[METHOD] = replace(of_band[METHOD], trials=trials)
    of_band["de"] = replace(of_band[METHOD], trials=trials.iloc[:2])
    return results


METHODS = [METHOD, "de"]


def test_a_predicted_flight_is_that_of_a_falling_point() -> None:
    points = drawing.flight(*LEAVE.values(), FLOOR)
    velocity = LEAVE["speed"] * np.array([np.cos(LEAVE["angle"]), np.sin(LEAVE["angle"])])

    def landed(_, state):
        return state[1] - FLOOR

    landed.terminal = True
    start = [LEAVE["leave_y"], LEAVE["leave_z"], *velocity]
    fall = solve_ivp(
        lambda _, s: [s[2], s[3], 0, -GRAVITY], (0, 5), start, events=landed, rtol=1e-10, atol=1e-10
    )
    np.testing.assert_allclose(points[0], [LEAVE["leave_y"], LEAVE["leave_z"]])
    np.testing.assert_allclose(points[-1], fall.y_events[0][0][:2], atol=1e-8)
    assert points[:, 1].max() > LEAVE["leave_z"]


def test_flights_end_where_they_land_and_targets_stand_on_the_floor(kept, results) -> None:
    drawing.trajectories("", results, METHODS, styles(METHODS), -FLOOR)
    first, second = kept[0].axes
    flights = [line for line in first.lines if len(line.get_xdata()) == 40]
    assert len(flights) == 3 + 1  # of the rig, and one prediction for two equal draws
    for line in flights:
        assert line.get_ydata()[-1] == pytest.approx(FLOOR)
    predicted = [line for line in flights if line.is_dashed()]
    expected = drawing.flight(*LEAVE.values(), FLOOR)[-1, 0]
    assert [line.get_xdata()[-1] for line in predicted] == [pytest.approx(expected)]
    ends = sorted(line.get_xdata()[-1] for line in flights if not line.is_dashed())
    np.testing.assert_allclose(ends, expected + np.array([-0.02, 0.04, 0.21]))
    targets = [line.get_xdata()[0] for line in first.lines if line.get_marker() == "^"]
    assert targets == [1.725, 1.925]
    assert first.texts[0].get_text() == "1 of 4 failed" and not second.texts
    assert first.get_aspect() == 1 and second.get_title().endswith("DE_L")


def test_measured_landings_without_a_flight_are_crosses_on_the_floor(kept, results) -> None:
    result = results.methods[BAND][METHOD]
    bare = result.trials.assign(kind="measured", flight_y=None, flight_z=None)
    results.methods[BAND][METHOD] = replace(result, trials=bare)
    drawing.trajectories("", results, [METHOD], styles(METHODS), -FLOOR)
    crosses = [line for line in kept[0].axes[0].lines if line.get_marker() == "x"]
    np.testing.assert_allclose([line.get_xdata()[0] for line in crosses], [1.70, 1.76, 1.93])
    np.testing.assert_allclose([line.get_ydata()[0] for line in crosses], FLOOR)
    assert "measured landing" in [text.get_text() for text in kept[0].legends[0].get_texts()]


def test_every_landing_lies_in_its_strip_at_its_distance(kept, results) -> None:
    drawing.scatter("", results, METHODS, styles(METHODS))
    (ax,) = kept[0].axes
    names = [label.get_text() for label in ax.get_xticklabels()]
    assert names == ["Sling2Sim2Real", "DE_L"]
    places = np.concatenate([dots.get_offsets() for dots in ax.collections])
    strip = np.floor(2 * places[:, 0])
    np.testing.assert_allclose(2 * places[:, 0] - strip, 0.5)  # on the strip's middle line
    landed = [sorted(places[strip == number, 1]) for number in range(2)]
    assert landed == [[1.70, 1.76, 1.93], [1.70, 1.76]]
    rings = [(*ring.center, ring.radius) for ring in ax.patches if isinstance(ring, Circle)]
    first = [(y, radius) for x, y, radius in rings if x < 1 / 3]
    assert first == [(1.725, 0.05), (1.725, 0.10), (1.925, 0.05), (1.925, 0.10)]
    assert {y for x, y, _ in rings if 1 / 3 < x} == {1.725}  # the others aim there alone
    assert ax.get_aspect() == 1
    assert [text.get_text() for text in ax.texts] == ["1 of 4\nfailed"]
    assert ax.get_ylabel() == "virtual landing, y [m]"


def test_measured_marks_are_hollow_and_failures_counted_by_kind(kept, results) -> None:
    """A launch that came down outside the area is one of the failures, and no mark."""
    result = results.methods[BAND][METHOD]
    outside = result.trials.assign(landing_y=[1.70, 1.76, 1.93, 2.6])
    outside.loc[3, "failure"] = "beyond the area: lands at 2.600 m"
    measured = outside.assign(kind="measured", landing_y=[1.71, None, 1.95, 2.7], failure=None)
    both = pd.concat([outside, measured], ignore_index=True)
    results.methods[BAND][METHOD] = replace(result, trials=both)
    drawing.scatter("", results, METHODS, styles(METHODS))
    (ax,) = kept[0].axes
    marks = {True: [], False: []}
    for dots in ax.collections:
        hollow = dots.get_facecolor().size == 0
        marks[hollow] += [y for x, y in dots.get_offsets() if x < 0.5]
    assert sorted(marks[False]) == [1.70, 1.76, 1.93] and sorted(marks[True]) == [1.71, 1.95]
    assert ax.get_ylabel() == "measured and virtual landing, y [m]"
    assert [text.get_text() for text in ax.texts] == ["2 of 4 measured\n1 of 4 virtual\nfailed"]
    assert "measured (filled: virtual)" in [t.get_text() for t in kept[0].legends[0].get_texts()]
    drawing.trajectories("", results, METHODS, styles(METHODS), -FLOOR)
    assert kept[1].axes[0].texts[0].get_text() == "2 of 4 measured,\n1 of 4 virtual failed"
