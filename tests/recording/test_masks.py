"""The band is found in every look, and nothing else; masks of another tool are as good."""

from __future__ import annotations

import shutil
from copy import copy
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.build import Processed, build_episodes, episode_of, process
from sling2sim2real.recording.clouds import clouds_of, masker
from sling2sim2real.recording.mask import Colors, RidgeMask, Shape
from sling2sim2real.recording.scene import View
from sling2sim2real.recording.streams import read_recording
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings.recording import CloudParams
from tests.project import with_
from tests.recording.conftest import part_of, processed_of, whole_of
from tests.recording.parts import joined
from validation.recordings import looks
from validation.recordings.looks import LOOKS, PHASES, TRUTH, figures

FRAMES = 24
# Depth alone decides: looks that differ in colour alone give equal clouds. A campaign has them all.
SLOW = pytest.mark.slow
THIN, APART = "4 mm thin, white, white arm", "orange, colour camera apart"


@pytest.fixture(scope="module")
def cloud():
    return CloudParams()


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


@pytest.fixture(scope="module")
def by_folder(params):
    return with_(params, "cloud", mask="folder")


@pytest.fixture(scope="module")
def folded(masked, by_folder) -> Processed:
    """`seen` by its masks; to be read only."""
    return processed_of(masked, by_folder)


def view_beside(folded: Processed, mine: Path) -> View:
    """Its view, whose masks are beside another recording."""
    view = copy(folded.view)
    view.recording = replace(view.recording, path=mine)
    return view


@pytest.fixture
def mine(masked, tmp_path) -> Path:
    """A recording with masks, to be spoiled."""
    shutil.copytree(masked.parent, tmp_path / "mine")
    return tmp_path / "mine" / "masked.mcap"


def files(recording: Path) -> list[Path]:
    return sorted(recording.with_suffix(".masks").iterdir())


def test_the_same_masks_give_the_same_episode_to_the_byte(episode, folded, by_folder) -> None:
    ours, theirs = episode, episode_of(folded, "band1")
    for name in ("time", "position", "velocity", "force", "opening", "cloud_time", "camera"):
        assert getattr(ours, name).tobytes() == getattr(theirs, name).tobytes()
    assert [cloud.tobytes() for cloud in ours.clouds] == [
        cloud.tobytes() for cloud in theirs.clouds
    ]
    assert sum(map(len, ours.clouds)) > 1000


def test_each_mask_counts_for_its_own_picture_and_no_other(mine, checked, by_folder) -> None:
    """Bands of one bit a pixel, as some tools write them; one is all black."""
    black = files(mine)[20]
    whole = np.asarray(Image.open(black)) > 0
    assert whole.any()
    Image.fromarray(np.zeros_like(whole)).save(black)
    Image.fromarray(np.asarray(Image.open(files(mine)[21])) > 0).save(files(mine)[21])
    theirs = whole_of(mine, by_folder)
    expected = checked.clouds.pixels.copy()
    expected[20] = 0
    assert theirs.clouds.pixels.tolist() == expected.tolist()


def test_a_late_camera_does_not_change_the_names(masked, params, by_folder) -> None:
    recording = read_recording(masked, params.setup).shifted(camera=-0.015)
    done = process(part_of(recording, params), params.bands["band1"], by_folder)
    assert done.delays.camera.applied
    assert done.whole.clouds.pixels.min() > 0


def test_what_a_mask_marks_where_the_band_cannot_be_is_not_the_band(mine, folded) -> None:
    for file in files(mine):
        Image.fromarray(np.full((240, 320), 7, np.uint8)).save(file)
    view = view_beside(folded, mine)
    mask = masker("folder", view)
    for _, frame in view.frames():
        np.testing.assert_array_equal(mask.mask(frame), frame.near)


@pytest.mark.slow
def test_masks_are_warped_to_a_depth_camera_of_its_own(tmp_path) -> None:
    """A tool that sees by colour marks the colour pictures: depth pixels of the band are found."""
    view, truths = looks.view_of(LOOKS["orange, colour camera apart"], looks.times(4))
    view.recording = replace(view.recording, path=tmp_path / "look.mcap")
    (tmp_path / "look.masks").mkdir()
    for number in range(len(view)):
        color = view.color(number).astype(int)
        orange = (color[..., 2] - color[..., 0] > 50).astype(np.uint8)
        stamp = round(looks.times(4)[number] * 1e9)
        cv2.imwrite(str(tmp_path / "look.masks" / f"{stamp}.png"), orange)
    mask, hits, wrong = masker("folder", view), [], []
    for number, frame in view.frames():
        pixels = mask.mask(frame)
        band = truths[number].part[view.window] == looks.BAND
        band &= np.abs(frame.depth - truths[number].depth[view.window]) < 0.005
        hits.append((pixels & band).sum() / band.sum())
        wrong.append((pixels & ~band & (frame.depth > 0)).sum() / pixels.sum())
    assert np.mean(hits) > 0.8 and np.mean(wrong) < 0.2


def _cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-30])


def _instead(file: Path, pixels: np.ndarray, kind: str = "png", mode: str = "L") -> None:
    Image.fromarray(pixels).convert(mode).save(file, format=kind)


GREY = np.zeros((240, 320), np.uint8)
SPOILED = {
    "no folder": (
        lambda mine: shutil.rmtree(mine.with_suffix(".masks")),
        "there is no such folder",
    ),
    "two missing": (
        lambda mine: [file.unlink() for file in files(mine)[3:5]],
        "masks of 2 of 54 pictures are missing, NAME first; give a black one",
    ),
    "too small": (
        lambda mine: _instead(files(mine)[3], GREY[:-1]),
        "NAME: is no grey PNG of 8 bits or 1, 320 x 240 pixels",
    ),
    "colour": (lambda mine: _instead(files(mine)[3], GREY, mode="RGB"), "NAME: is no grey PNG"),
    "16 bits": (
        lambda mine: Image.fromarray(GREY.astype(np.uint16)).save(files(mine)[3]),
        "NAME: is no grey PNG",
    ),
    "JPEG": (lambda mine: _instead(files(mine)[3], GREY, "jpeg"), "NAME: is no grey PNG"),
    "empty": (lambda mine: files(mine)[3].write_bytes(b""), "NAME: a mask: damaged image"),
    "cut off": (lambda mine: _cut(files(mine)[3]), "NAME: a mask: damaged image"),
    "all black": (
        lambda mine: [_instead(file, GREY) for file in files(mine)],
        "not found in 54 of 54 frames: check the camera's extrinsics and the masks",
    ),
}


WHOLE = "no folder", "cut off", "all black"  # as an episode is refused; the others: their masks


@pytest.mark.parametrize("how", SPOILED)
def test_masks_that_cannot_be_used_are_named_in_one_line(how, mine, folded, by_folder) -> None:
    spoil, words = SPOILED[how]
    name = files(mine)[3].name
    spoil(mine)
    with pytest.raises(UserError, match=words.replace("NAME", name)) as caught:
        if how in WHOLE:
            build_episodes(mine, "band1", by_folder)
        view = view_beside(folded, mine)
        mask = masker("folder", view)
        for _, frame in view.frames():
            mask.mask(frame)
    place = f"{mine}: " if how in WHOLE else str(mine.with_suffix(".masks"))
    assert str(caught.value).startswith(place) and "\n" not in str(caught.value)


def test_masks_of_the_first_pull_alone_leave_the_second_out(masked, tmp_path, by_folder) -> None:
    path = tmp_path / "masked.mcap"
    joined(path, [masked, masked])
    shutil.copytree(masked.with_suffix(".masks"), tmp_path / "masked.masks")
    episodes, refused = build_episodes(path, "band1", by_folder)
    assert len(episodes) == 1 and len(refused) == 1
    assert "pull 2 of 2: " in str(refused[0]) and "masks of 54 of 54" in str(refused[0])
