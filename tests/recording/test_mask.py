"""The band is found in every look, and nothing else is taken for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.clouds import clouds_of
from sling2sim2real.recording.mask import Colors, RidgeMask, Shape
from sling2sim2real.recording.scene import View
from sling2sim2real.recording.transforms import Transform
from tests.project import DEFAULTS
from validation.recordings import looks
from validation.recordings.looks import LOOKS, PHASES, TRUTH, figures

FRAMES = 24
# Depth alone decides: looks that differ in colour alone give equal clouds. A campaign has them all.
SLOW = pytest.mark.slow
THIN, APART = "4 mm thin, white, white arm", "orange, colour camera apart"


@pytest.fixture(scope="module")
def cloud():
    return load(DEFAULTS).cloud


@pytest.mark.parametrize(
    "name", ["near white beside a white arm", *(pytest.param(n, marks=SLOW) for n in (THIN, APART))]
)
def test_clouds_lie_on_the_band_and_cover_it(name, cloud) -> None:
    view, truths = looks.view_of(LOOKS[name], looks.times(FRAMES))
    result = figures(view, truths, clouds_of(view, cloud))
    assert set(result) == {*PHASES, "all"}
    assert result["all"]["median_off_m"] <= 0.003
    assert result["all"]["covered"] >= 0.9
    assert result["all"]["further_than_1cm"] <= 0.01
    for phase in PHASES:
        assert result[phase]["median_off_m"] <= 0.003
        assert result[phase]["covered"] >= 0.8
        assert result[phase]["further_than_1cm"] <= 0.05


def test_a_hand_that_is_not_seen_alone_is_left_out_with_more_room(cloud) -> None:
    """It turns, so what is learned of it in one picture does not fit the next."""
    view, truths = looks.view_of(LOOKS["near white beside a white arm"], looks.times(FRAMES))
    view.scene.signals.facts.turn = 0.5
    result = figures(view, truths, clouds_of(view, cloud))
    assert result["all"]["median_off_m"] <= 0.003
    assert result["all"]["covered"] >= 0.85
    assert result["all"]["further_than_1cm"] <= 0.01


def test_shadows_are_not_the_band() -> None:
    """The dark line of the band's shadow on the floor, and the floor beside the band."""
    view, truths = looks.view_of(LOOKS["dark in shadow, dark floor and arm"], looks.times(FRAMES))
    mask = RidgeMask(view)
    for number, frame in view.frames(range(FRAMES - 4, FRAMES)):
        truth = truths[number]
        still = truth.part[view.window] < looks.WALL
        still &= np.abs(frame.depth - truth.depth[view.window]) < 0.005  # no flying pixel
        assert still.sum() > 10_000
        assert not (mask.mask(frame) & still).any()


def test_colors_count_only_where_they_tell_apart() -> None:
    random = np.random.default_rng(0)

    def seen(color, shades):
        bright = random.uniform(*shades, (2000, 1))
        return np.clip(bright * color + random.normal(0, 2, (2000, 3)), 0, 255).astype(np.uint8)

    orange, white = (30, 120, 235), (230, 230, 230)
    colors = Colors.learn(seen(orange, (0.4, 1)), seen(white, (0.4, 1)))
    assert colors.against(seen(white, (0.5, 1))).mean() > 0.9
    assert colors.against(seen(orange, (0.2, 1))).mean() < 0.02  # nor in shadow
    assert not colors.against(np.full((1, 3), 4, np.uint8)).any()  # the dark tells nothing
    assert Colors.learn(seen(white, (0.9, 1)), seen(white, (0.3, 0.6))) is None  # lit differently
    assert Colors.learn(seen(orange, (0.4, 1))[:50], seen(white, (0.4, 1))) is None


def test_the_hand_is_what_moves_with_it() -> None:
    random = np.random.default_rng(0)
    finger = random.uniform([-0.01, -0.05, -0.01], [0.01, 0.01, 0.01], (3000, 3))
    flying = [random.uniform(-0.2, 0.2, (50, 3)) for _ in range(6)]
    shape = Shape.learn(np.concatenate([finger, noise]) for noise in flying)
    assert shape.holds(finger).all()
    assert not shape.holds(finger + [0.05, 0, 0]).any()
    assert shape.holds(flying[0]).mean() < 0.05
    assert not shape.holds(np.array([[0.0, 5.0, 0.0]])).any()  # beyond what was looked at
    assert Shape.learn([finger] * 3) is None  # too few pictures
    other = Shape.learn([finger + [0.05, 0, 0]] * 6)
    assert Shape.swept(shape, other).holds(finger + [0.025, 0, 0]).mean() > 0.9


def test_without_a_taut_frame_no_colour_counts(cloud) -> None:
    """Where the band is longer than the hand goes, nothing is surely the band."""
    view, _ = looks.view_of(LOOKS["orange on grey, white arm"], looks.times(8))
    long = replace(view.scene, rest_length=2.0)
    slack = View(view.recording, view.geometry, long, TRUTH.end)
    assert not clouds_of(slack, cloud).color_counts


def test_a_camera_that_looks_elsewhere_is_told_so() -> None:
    view, _ = looks.view_of(LOOKS["orange on grey, white arm"], looks.times(8))
    for turn in ([0, 2.0, 0], [1.0, 0, 0]):
        aside = Transform(Rotation.from_rotvec(turn), np.zeros(3))
        geometry = replace(view.geometry, camera=view.geometry.camera @ aside)
        with pytest.raises(UserError, match="looks past where the band can be"):
            View(view.recording, geometry, view.scene, TRUTH.end)


def test_what_is_said_to_touch_the_lens_is_nowhere(cloud) -> None:
    """A camera so near that the band could reach it, with pixels of a few millimetres."""
    view, _ = looks.view_of(LOOKS["orange on grey, white arm"], looks.times(8))
    there = Transform(view.geometry.camera.rotation, np.array([0.0, 0.05, 0.0]))
    close = View(view.recording, replace(view.geometry, camera=there), view.scene, TRUTH.end)
    depth = np.full((480, 640), 0.2, np.float32)
    depth[::40, ::40] = 0.003
    frame = close.rgbd_frame(0, depth, view.color(0))
    assert not frame.near[frame.depth < 0.1].any() and frame.near.any()
