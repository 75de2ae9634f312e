"""Pictures of the report, read back from the objects that were drawn."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Ellipse

from pipeline.report.figures import confidence, landings, policy, search
from pipeline.report.figures.pull import pull
from sling2sim2real.drawing import canvas
from sling2sim2real.drawing.styles import styles
from tests.report.conftest import BAND, METHOD, episode, launches
from tests.report.toy_replay import toy_replay


@pytest.fixture
def retained(monkeypatch) -> list[plt.Figure]:
    """Figures that were drawn, in place of their files."""
    figures: list[plt.Figure] = []
    monkeypatch.setattr(canvas, "save", lambda figure, *_: figures.append(figure))
    yield figures
    plt.close("all")


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
    assert names == ["paper", "DE_L"]
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


STILL = episode()
DEPTH = np.clip(STILL.time / 20, 0, 0.4)
RECORDED = replace(STILL, position=np.stack([0 * DEPTH, -0.8 * DEPTH, -0.6 * DEPTH], 1))
HELD = (STILL.time >= 1) & (STILL.time <= 8 - 2 * STILL.sample_period)
SIZE = np.hypot(STILL.time, np.sin(STILL.time))


def test_force_over_draw_and_what_is_left_over_time(retained) -> None:
    played = toy_replay(None, None, RECORDED, {}, None)
    pull("", {BAND: RECORDED}, {BAND: {METHOD: played}}, styles([METHOD]))
    top, middle, bottom = retained[0].axes
    measured, simulated = top.lines
    np.testing.assert_allclose(measured.get_xdata(), DEPTH[HELD])  # from grasp to release
    np.testing.assert_allclose(measured.get_ydata(), SIZE[HELD])
    np.testing.assert_allclose(simulated.get_ydata(), 0.9 * SIZE[HELD])
    left = 0.1 * np.linalg.norm(RECORDED.force, axis=1)
    np.testing.assert_allclose(middle.lines[0].get_ydata(), left)
    np.testing.assert_allclose(bottom.lines[0].get_ydata(), 1.0)  # cm


def test_a_recording_alone_is_drawn_too(retained) -> None:
    pull("", {BAND: RECORDED}, {}, {})
    assert len(retained[0].axes[0].lines) == 1
    assert [text.get_text() for text in retained[0].legends[0].get_texts()] == ["measured"]


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


def test_correlations_are_written_into_half_of_their_cells(retained, result) -> None:
    confidence.correlation("", {BAND: result.confidence, "other": result.confidence})
    first, second, _ = retained[0].axes
    assert (first.get_title(), second.get_title()) == (BAND, "other")
    (image,) = first.images
    np.testing.assert_array_equal(image.get_array(), result.confidence["correlation"]["matrix"])
    assert [(t.get_position(), t.get_text()) for t in first.texts] == [((0, 1), "−0.9")]
    assert METHOD not in first.get_title()
