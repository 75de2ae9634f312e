"""The recording beside the simulation, read back from the objects that were drawn."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.drawing.styles import styles
from pipeline.report.figures import episode as drawing
from tests.drawing.toy_replay import toy_replay
from tests.report.conftest import BAND, METHOD, episode

STYLES = styles([METHOD])


@pytest.fixture
def recorded():
    """The hand moves back at 0.1 m/s; the band crosses the fork plane 0.2 s after the release."""
    still = episode()
    clouds = [
        cloud - [0, 0.4, 0] if time < 8.2 else cloud + [0, 0.3, 0]
        for cloud, time in zip(still.clouds, still.cloud_time, strict=True)
    ]
    return replace(still, velocity=still.velocity + [0, -0.1, 0], clouds=clouds)


def replays(recorded) -> dict:
    return {METHOD: toy_replay(None, "", METHOD, recorded, {})}


def test_force_residual_and_distance_over_time(kept, recorded) -> None:
    drawing.force("", recorded, replays(recorded), STYLES)
    axes = np.array(kept[0].axes).reshape(4, 2)
    for column in (0, 1):
        measured, simulated = axes[0, column].lines[:2]
        np.testing.assert_array_equal(measured.get_ydata(), recorded.force[:, 1])
        np.testing.assert_allclose(simulated.get_ydata(), 0.9 * recorded.force[:, 1])
        residual = axes[2, column].lines[0].get_ydata()
        np.testing.assert_allclose(residual, 0.1 * np.linalg.norm(recorded.force, axis=1))
        np.testing.assert_allclose(axes[3, column].lines[0].get_ydata(), 1.0)  # cm
    low, high = axes[0, 1].get_xlim()
    assert low < recorded.release_time < high and high - low < 1


def test_work_and_where_it_ends_apart(kept, recorded) -> None:
    drawing.work("", recorded, replays(recorded), STYLES)
    left, right = kept[0].axes
    # f_y = t until 8 s, v_y = -0.1 m/s: the band does -0.1 * 32 J on the hand; where in its sample
    # the force falls from 8 N, trapezoids cannot know
    known = 0.1 * 8 * recorded.sample_period / 2
    assert left.lines[0].get_ydata()[-1] == pytest.approx(-3.2, abs=known)
    assert right.lines[0].get_ydata()[-1] == pytest.approx(-0.32, abs=known / 10)
    assert right.texts[0].get_text().startswith("−0.32")


def test_the_moments_are_those_of_the_recoil(recorded) -> None:
    frames = drawing.moments(recorded)
    times = {name: recorded.cloud_time[frame] for name, frame in frames.items()}
    assert times["held at full draw"] == pytest.approx(7.8)
    assert times["taut recoil"] == pytest.approx(8.1)
    assert times["just past it"] == pytest.approx(8.2)
    assert times["swinging"] == pytest.approx(8.5)
    assert recorded.grasp_time < times["slack in the hand"] < 7.8


def test_a_recording_without_a_frame_in_the_recoil_has_pictures_too(kept, recorded) -> None:
    blind = replace(recorded, clouds=[cloud + [0, 1, 0] for cloud in recorded.clouds])
    frames = drawing.moments(blind)
    assert "taut recoil" not in frames and "swinging" in frames
    drawing.clouds("", blind, replays(blind), STYLES, frames, 0.01)
    assert len(kept[0].axes) == 2 * len(frames)


def test_clouds_are_as_thick_as_the_band_and_at_one_scale(kept, recorded) -> None:
    drawing.clouds("", recorded, replays(recorded), STYLES, drawing.moments(recorded), 0.01)
    figure = kept[0]
    scales = set()
    for ax in figure.axes:
        points, line, tube = ax.lines
        assert len(points.get_xdata()) == len(line.get_xdata()) == 25
        per_metre = np.diff(ax.transData.transform([[0, 0], [1, 0]])[:, 0])[0]
        scales.add(round(per_metre))
        assert tube.get_linewidth() == pytest.approx(0.01 * per_metre * 72 / figure.dpi)
    assert len(scales) == 1
    assert figure.axes[0].texts[0].get_text() == "1.00 cm"


def under_load(recorded, of_band) -> None:
    drawing.loaded("", {BAND: recorded}, {BAND: of_band}, styles([METHOD, "de"]), 0.275, 0.52)


def test_the_weight_hangs_at_the_middle_and_its_depth_is_told(kept) -> None:
    recorded = episode()
    one = replays(recorded)[METHOD]
    lost = replace(one, loaded=np.full((25, 3), np.nan))
    under_load(recorded, {METHOD: one, "de": lost})
    top, _ = kept[0].axes
    shapes = [line for line in top.lines if len(line.get_xdata()) == 25]
    np.testing.assert_array_equal(shapes[0].get_ydata(), one.loaded[:, 2])
    (weight,) = (line for line in top.lines if line.get_marker() == "o")
    assert weight.get_ydata()[0] == pytest.approx(-0.4)
    assert [text.get_text() for text in top.texts] == ["40.0 cm", "not found"]
    assert top.get_aspect() == 1 and top.get_ylim()[0] < -0.4


def test_force_over_the_hands_draw_from_grasp_to_release(kept) -> None:
    still = episode()
    depth = np.clip(still.time / 20, 0, 0.4)
    recorded = replace(still, position=np.stack([0 * depth, -0.8 * depth, -0.6 * depth], 1))
    under_load(recorded, replays(recorded))
    measured, simulated = kept[0].axes[1].lines
    held = (still.time >= 1) & (still.time <= 8 - 2 * still.sample_period)
    np.testing.assert_allclose(measured.get_xdata(), depth[held])
    size = np.hypot(still.time, np.sin(still.time))[held]
    np.testing.assert_allclose(measured.get_ydata(), size)
    np.testing.assert_allclose(simulated.get_ydata(), 0.9 * size)
