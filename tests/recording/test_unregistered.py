"""Depth of a camera of its own: another place, lens and resolution than the colour camera's."""

from __future__ import annotations

from contextlib import contextmanager

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.recording.build import build_episode
from pipeline.recording.input.reader import read_recording
from tests.recording import bag

LENS = bag.Lens(size=(424, 240), focal=215.0)
TURN = Rotation.from_euler("xyz", [0.4, -0.8, 0.3], degrees=True)  # of depth in colour
SHIFT = np.array([-0.015, 0.001, 0.002])


@contextmanager
def depth_camera():
    """The renderer looks through the depth camera."""
    usual = bag.CAMERA, bag.EYE
    bag.CAMERA, bag.EYE = bag.CAMERA * TURN, bag.EYE + bag.CAMERA.apply(SHIFT)
    try:
        yield
    finally:
        bag.CAMERA, bag.EYE = usual


@pytest.fixture(scope="module")
def unregistered(tmp_path_factory):
    truth, infos = bag.Truth(), []

    def tree(stamp: int, message) -> None:
        message.transforms.append(bag._transform("optical", "depth_optical", TURN, SHIFT))

    def info(stamp: int, message) -> None:
        infos.append(message)
        if len(infos) % 2 == 0:  # the depth's
            vars(message).update(bag._info(LENS))
            message.header.frame_id = "depth_optical"

    def depth(stamp: int, message) -> None:
        message.header.frame_id = "depth_optical"
        with depth_camera():
            _, pixels = bag.render(truth, (stamp - bag.START) * 1e-9, LENS)
        message.data = bytes(12) + cv2.imencode(".png", pixels)[1].tobytes()

    path = tmp_path_factory.mktemp("bag") / "unregistered.mcap"
    change = bag.edit(tf=tree, info=info, depth=depth)
    return path, bag.write_bag(path, truth, change=change, rate=500)


def test_each_camera_is_read_as_it_is(unregistered, params) -> None:
    recording = read_recording(unregistered[0], params.setup)
    color, depth = recording.color_camera, recording.depth_camera
    assert (color.width, color.height, color.matrix[0, 0]) == (320, 240, 250.0)
    assert (depth.width, depth.height, depth.matrix[0, 0]) == (424, 240, 215.0)
    between = recording.transforms.between("optical", "depth_optical")
    np.testing.assert_allclose(between.translation, SHIFT)


def test_clouds_lie_on_the_band(unregistered, params) -> None:
    path, truth = unregistered
    off, covered = bag.scores(build_episode(path, "band1", params), truth)
    assert np.median(np.abs(off)) <= 0.003
    assert covered >= 0.9
