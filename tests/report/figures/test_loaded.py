"""The bands under load, read back from the objects that were drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.report.figures import episode as drawing
from pipeline.report.styles import styles
from tests.report.conftest import BAND, METHOD, episode
from tests.report.toy_replay import toy_replay


def drawn(recorded, replays) -> None:
    drawing.loaded("", {BAND: recorded}, {BAND: replays}, styles([METHOD, "de"]), 0.275, 0.52)


def test_the_weight_hangs_at_the_middle_and_its_depth_is_told(kept) -> None:
    recorded = episode()
    one = toy_replay(None, "", METHOD, recorded, {})
    lost = replace(one, loaded=np.full((25, 3), np.nan))
    drawn(recorded, {METHOD: one, "de": lost})
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
    drawn(recorded, {METHOD: toy_replay(None, "", METHOD, recorded, {})})
    measured, simulated = kept[0].axes[1].lines
    held = (still.time >= 1) & (still.time <= 8 - 2 * still.sample_period)
    np.testing.assert_allclose(measured.get_xdata(), depth[held])
    size = np.hypot(still.time, np.sin(still.time))[held]
    np.testing.assert_allclose(measured.get_ydata(), size)
    np.testing.assert_allclose(simulated.get_ydata(), 0.9 * size)
