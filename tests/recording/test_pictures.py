"""Pictures that cannot be decoded, or are of another unit, stop with that reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.images import depth
from sling2sim2real.recording.messages import Picture
from tests.recording.conftest import whole_of
from tests.recording.made import of_pictures
from validation.recordings.bag import Lens, write_bag
from validation.recordings.small import TRUTH, small_params

LENS = Lens(size=(160, 120), focal=125.0, fps=8)
PARAMS = small_params()


def looked_at(folder, change):
    """What becomes of a small recording with these pictures."""
    path = folder / "my.mcap"
    write_bag(path, TRUTH, rate=200, pose_rate=50, lens=LENS, change=change)
    return whole_of(path, PARAMS)


def of_color(edit):
    """A `change` that edits the bytes of the colour pictures, by number."""
    numbers = iter(range(10_000))

    def change(kind: str, stamp: int, message):
        if kind == "color":
            message.data = edit(next(numbers), message.data)
        return message

    return change


def test_colour_that_cannot_be_decoded_stops_before_an_episode(tmp_path) -> None:
    for edit, reason in (
        (lambda k, data: data[: len(data) // 2] + bytes(3000), "JPEG is cut off"),
        (lambda k, data: b"no picture", "damaged image"),
    ):
        with pytest.raises(UserError) as caught:
            looked_at(tmp_path, of_color(edit))
        assert "its pictures cannot be decoded: " in str(caught.value) and reason in str(
            caught.value
        )


def test_what_can_be_decoded_is_read_and_the_rest_is_counted_as_colour(tmp_path) -> None:
    padded = looked_at(tmp_path, of_color(lambda k, data: data + bytes(3000)))
    assert padded.clouds.damaged == padded.clouds.damaged_colors == 0
    some = looked_at(tmp_path, of_color(lambda k, data: data[: len(data) // (1 + (k % 4 == 0))]))
    output = [finding.what for finding in of_pictures(some) if finding.about == "damaged"]
    assert output == [f"{some.clouds.damaged_colors} colour pictures cannot be decoded"]
    assert len(some.clouds.points) + some.clouds.damaged == len(padded.clouds.points)


def written(pixels: np.ndarray, factor: float, kind: type, swapped: bool = False) -> Picture:
    """As a driver would send it, of depth in millimetres."""
    values = (pixels * factor).astype(np.dtype(kind).newbyteorder("<"))
    encoding = "16UC1" if kind is np.uint16 else "32FC1"
    height, width = pixels.shape
    step, data = values.itemsize * width, values.view(np.uint8).ravel()
    return Picture(encoding, "", data, height, width, step, swapped)


@pytest.mark.parametrize(
    "factor, kind, swapped, output",
    [
        *((factor, np.uint16, False, f"about {factor:g} times") for factor in (10, 4, 3, 0.1)),
        (1, np.float32, False, "about 1000 times"),
        *((f, kind, True, "of the byte order") for f, kind in ((1, np.uint16), (1e-3, np.float32))),
        (1, np.uint16, False, None),
        (0.001, np.float32, False, None),
    ],
)
def test_depth_of_another_unit_or_order(
    tmp_path, monkeypatch, factor, kind, swapped, output
) -> None:
    """What a driver would send is put in the place of what the recording holds."""
    from sling2sim2real.recording import build
    from sling2sim2real.recording.streams import Recording

    read = build.read_recording

    def driver(*arguments) -> Recording:
        recording = read(*arguments)
        values = [
            written(np.round(1000 * depth(value)), factor, kind, swapped)
            for value in recording.depth.values
        ]
        return replace(recording, depth=replace(recording.depth, values=values))

    monkeypatch.setattr(build, "read_recording", driver)
    if output is None:
        assert looked_at(tmp_path, lambda kind, stamp, message: message).clouds.empty == 0
        return
    with pytest.raises(UserError, match=output):
        looked_at(tmp_path, lambda kind, stamp, message: message)
