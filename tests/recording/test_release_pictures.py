"""Which picture is the first without the drawn band, and what that says of the camera's clock."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.recording import images
from sling2sim2real.recording.checks import of_release
from sling2sim2real.recording.delays import correct_delays
from sling2sim2real.recording.events import Pull
from sling2sim2real.recording.messages import Picture
from sling2sim2real.recording.release_pictures import ReleasePictures, release_pictures
from tests.recording.conftest import pull_of

SOUND = ReleasePictures(-0.03, 0.02, -0.015, 0.02, (), ())


@pytest.fixture(scope="module")
def pull(seen, params) -> Pull:
    return pull_of(seen[0], params)


@pytest.mark.parametrize("late", [-0.2, -0.06, 0.0, 0.06, 0.2])
def test_the_delay_is_between_both_ends(pull, params, late) -> None:
    pictures = release_pictures(pull.shifted(camera=-late), params.setup.fork_width)
    assert pictures.earliest <= late <= pictures.latest
    assert pictures.latest - pictures.earliest < 1.3 * pull.recording.depth.period + 0.02
    if abs(late) < 0.001:
        assert pictures.beyond == 0
        assert not list(of_release(replace(pictures, repeated=())))
    if abs(late) > 0.1:
        assert pictures.beyond > 0
        assert [finding.about for finding in of_release(pictures)][-1:] == ["release_pictures"]


def test_what_the_pictures_show_goes_before_the_hand(pull, params) -> None:
    """A camera that is 0.2 s late is nearly right after the correction, or said to be unclear."""
    moved, estimates = correct_delays(pull.shifted(camera=-0.2), params)
    left = (moved.recording.depth.stamp - pull.recording.depth.stamp) * 1e-9
    assert abs(left).max() < 3 * (estimates.camera.left or 0.0) + 1e-9
    assert estimates.camera.applied


def test_black_pictures_show_nothing(blind, params) -> None:
    dark = pull_of(blind[0], params)
    assert release_pictures(dark, params.setup.fork_width) is None


@pytest.mark.fires("release_pictures")
def test_old_pictures_over_the_release_are_refused() -> None:
    held = replace(SOUND, repeated=(-0.2, -0.1, -0.015))  # of a scene without noise
    assert not list(of_release(held))
    for odd in (
        replace(SOUND, repeated=(0.053,)),
        replace(SOUND, repeated=(0.01,)),
        replace(SOUND, drawn=0.2, gone=0.23, earliest=0.18, latest=0.23, repeated=(0.1, 0.2)),
    ):
        (message,) = of_release(odd)
        assert message.about == "release_pictures" and message.refused


def test_pictures_without_depth_or_in_disorder_make_no_delay_up(pull, params) -> None:
    """Of an emitter that is switched on and off every second one is empty."""
    depth = pull.recording.depth
    nothing = np.zeros_like(images.depth(depth.values[0]))
    blank = Picture("32FC1", "", nothing.view(np.uint8).ravel(), *nothing.shape, nothing.strides[0])
    values = [blank if k % 2 else picture for k, picture in enumerate(depth.values)]
    flickers = replace(pull.recording, depth=replace(depth, values=values))
    pictures = release_pictures(replace(pull, recording=flickers), params.setup.fork_width)
    assert pictures.earliest <= 0 <= pictures.latest and not pictures.again
    assert replace(SOUND, drawn=-0.3, gone=-0.27, latest=-0.27, again=(-0.2,)).beyond == 0


def test_a_band_that_is_never_let_go_is_refused(pull, params) -> None:
    depth = pull.recording.depth
    since = depth.seconds(pull.recording.origin) - pull.release.time
    held = depth.values[int(np.searchsorted(since, -0.1))]
    values = [
        held if time > -0.1 else picture for time, picture in zip(since, depth.values, strict=True)
    ]
    frozen = replace(pull.recording, depth=replace(depth, values=values))
    pictures = release_pictures(replace(pull, recording=frozen), params.setup.fork_width)
    assert pictures.never and pictures.beyond == 0 and pictures.frozen
    for case in (pictures, replace(pictures, repeated=())):
        (message,) = of_release(case)
        assert message.refused


@pytest.mark.fires("release_pictures")
def test_impossible_pictures_are_said() -> None:
    late = replace(SOUND, drawn=0.06, gone=0.09, earliest=0.045, latest=0.09)
    again = replace(SOUND, again=(0.15,))
    message = [finding.about for odd in (late, again) for finding in of_release(odd)]
    assert message == ["release_pictures", "release_pictures"]
    assert not list(of_release(SOUND)) and np.isclose(SOUND.error, 0.05 / np.sqrt(12))
