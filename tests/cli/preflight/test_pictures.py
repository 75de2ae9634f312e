"""The sheet, read back by others than those who wrote it."""

import cv2
import numpy as np

from sling2sim2real.cli.preflight.sheet import MOMENTS, draw_sheet, masked_frames, moments


def test_the_sheet_shows_six_moments(looked, params, tmp_path) -> None:
    path = tmp_path / "sheet.png"
    assert str(path) in draw_sheet(looked, params, path)
    image = cv2.imread(str(path))
    assert image.shape[1] == 1600
    blue, green, red = image[: image.shape[0] // 4].astype(int).transpose(2, 0, 1)
    outline = np.minimum(blue, red) > green + 50  # towards the colour of the mask
    columns = np.array_split(outline, len(MOMENTS), axis=1)
    assert all(column.sum() > 50 for column in columns)
    assert [p.name for p in tmp_path.iterdir()] == ["sheet.png"]


def test_moments_follow_the_events(looked) -> None:
    scene, when = looked.done.scene, moments(looked.done.scene)
    assert list(when) == list(MOMENTS) and sorted(when.values()) == list(when.values())
    assert not scene.holds(when["hanging"]) and scene.holds(when["grasp"])
    assert (
        not scene.taut(when["lift"]) and scene.taut(when["mid pull"]) and scene.taut(when["held"])
    )
    assert not scene.holds(when["recoil"])


def test_masks_are_those_of_the_clouds(looked, params) -> None:
    counts = [int(mask.sum()) for _, mask in masked_frames(looked.done, params.cloud)]
    assert counts == looked.done.clouds.pixels.tolist()


def test_a_refused_recording_shows_what_it_has(refused, params, tmp_path) -> None:
    assert refused.report["problem"]
    message = draw_sheet(refused, params, tmp_path / "sheet.png")
    assert "all that can be shown" in message
    assert cv2.imread(str(tmp_path / "sheet.png")).shape[1] == 1600
