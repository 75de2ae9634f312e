"""The recording beside the simulation, read back from the objects that were drawn."""

from dataclasses import replace

import numpy as np

from pipeline.report.drawing.styles import styles
from pipeline.report.run.figures.pull import pull
from tests.report.run.conftest import BAND, METHOD, episode
from tests.report.run.toy_replay import toy_replay

STILL = episode()
DEPTH = np.clip(STILL.time / 20, 0, 0.4)
RECORDED = replace(STILL, position=np.stack([0 * DEPTH, -0.8 * DEPTH, -0.6 * DEPTH], 1))
HELD = (STILL.time >= 1) & (STILL.time <= 8 - 2 * STILL.sample_period)
SIZE = np.hypot(STILL.time, np.sin(STILL.time))


def test_force_over_draw_and_what_is_left_over_time(retained) -> None:
    played = toy_replay(None, "", METHOD, RECORDED, {})
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
