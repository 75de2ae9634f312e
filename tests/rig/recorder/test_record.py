from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from pipeline.params import Params
from rig.recorder import camera
from rig.recorder.interaction import Interaction
from rig.recorder.record import INSTANTS, record
from sling2sim2real.base.errors import UserError
from tests.project import with_
from tests.rig.conftest import SCALE

COUNTS = {
    "/tf_static": 1,
    "/franka_gripper/joint_states": 500,
    "/franka_robot_state_broadcaster/current_pose": 10_000,
    "/ft_sensor/wrench": 10_000,
}
PICTURES = [
    "/camera/color/image_raw/compressed",
    "/camera/color/camera_info",
    "/camera/depth/camera_info",
    "/camera/depth/image_raw/compressedDepth",
]

FORCE_TOPICS = ("/tf_static", "/franka_robot_state_broadcaster/current_pose", "/ft_sensor/wrench")


@pytest.fixture(scope="module")
def messages(recorded: tuple[Path, Interaction]) -> dict[str, list[Any]]:
    return read(recorded[0])


def read(path: Path, *only: str) -> dict[str, list[Any]]:
    """Decoded by another library than the one that wrote them; `only` some topics."""
    topics: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages(only or None):
            topics.setdefault(channel.topic, []).append(message)
    return topics


def seconds(message: Any) -> float:
    return message.header.stamp.sec - 1_760_000_000 + message.header.stamp.nanosec * 1e-9


def rotation(quaternion: Any) -> Rotation:
    return Rotation.from_quat([quaternion.x, quaternion.y, quaternion.z, quaternion.w])


def vector(of: Any) -> np.ndarray:
    return np.array([of.x, of.y, of.z])


def transforms(messages: dict[str, list[Any]]) -> dict[str, Any]:
    return {
        transform.child_frame_id: transform.transform
        for transform in messages["/tf_static"][0].transforms
    }


def test_topics_and_counts(messages: dict[str, list[Any]], coarse: Params) -> None:
    assert set(messages) == {*COUNTS, *PICTURES}
    for topic, count in COUNTS.items():
        assert len(messages[topic]) == count
    frames = {len(messages[topic]) for topic in PICTURES}
    assert len(frames) == 1 and 280 <= frames.pop() < 299  # some are dropped
    stamps = np.array([seconds(m) for m in messages["/ft_sensor/wrench"]])
    astray = stamps - np.arange(10_000) / 1000
    assert np.isclose(astray.std(), coarse.rig.clock.stamp_jitter, rtol=0.05)
    assert (np.diff(stamps) > 0).all()


def test_same_schemas_as_a_lab_writes(recorded: tuple[Path, Interaction], shared: Path) -> None:
    def schemas(path: Path) -> dict[str, tuple]:
        with open(path, "rb") as stream:
            summary = make_reader(stream).get_summary()
        return {
            channel.topic: (
                channel.message_encoding,
                summary.schemas[channel.schema_id].name,
                summary.schemas[channel.schema_id].encoding,
                summary.schemas[channel.schema_id].data.strip(),
            )
            for channel in summary.channels.values()
        }

    assert schemas(recorded[0]) == schemas(shared / "recordings" / "orange.mcap")


def response(messages: dict[str, list[Any]]) -> np.ndarray:
    """Force as a lab would see it (T, 3): in frame O by /tf_static and the pose, tared."""
    frames = transforms(messages)
    pose = messages["/franka_robot_state_broadcaster/current_pose"][0].pose
    base, sensor = frames["panda_link0"], frames["ft_sensor"]
    turn = rotation(base.rotation) * rotation(pose.orientation) * rotation(sensor.rotation)
    force = turn.apply([vector(m.wrench.force) for m in messages["/ft_sensor/wrench"]])
    return force - force[:900].mean(axis=0)


@pytest.mark.slow
def test_force_peaks_as_the_papers_and_the_same_seed_gives_the_same_bytes(
    coarse: Params, messages: dict[str, list[Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(camera, "RATE", 1.0)
    quick = with_(coarse, "rig", edges=24, tolerance=5e-4)
    stated = {12.18: messages}
    for name, band, peak in (("a", "band2", 14.25), ("b", "band2", 14.25), ("c", "band3", 16.70)):
        record(quick, band, tmp_path / name, picture_scale=0.1)
        stated[peak] = stated.get(peak) or read(tmp_path / name, *FORCE_TOPICS)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    for peak, received in stated.items():
        smooth = np.convolve(response(received)[:, 1], np.ones(50) / 50, "same")
        assert np.isclose(smooth.max(), peak, rtol=0.01)
        assert 5.5 < np.argmax(smooth) / 1000 < 6.5
        assert np.abs(smooth[9500:9900]).max() < 0.1  # the hand is at rest again
        assert smooth[7900] < 0.995 * smooth.max()  # it relaxes in the pause


def test_the_tool_swings_back_into_the_wrench(messages, recorded, coarse) -> None:
    """What the sensor feels beyond the band is the tool's weight and inertia, and a drifting bias.

    Let go, the hand starts back with F / M, so that the sensor feels m F / M.
    """
    happened, rig = recorded[1], coarse.rig
    slip = happened.slip_time
    just, before = round(1000 * slip) + 2, round(1000 * slip) - 2
    jolt = rig.wrench.tool_mass / rig.arm.mass * happened.force[before, 1]
    assert 0.8 * jolt < -rig.wrench.tool_mass * happened.acceleration[just, 1] < 1.2 * jolt
    rest = response(messages) - happened.force + rig.wrench.tool_mass * happened.acceleration
    rest -= rest[:300].mean(axis=0)
    assert np.abs(rest.mean(axis=0)).max() < rig.wrench.drift
    assert np.abs(rest - rest.mean(axis=0)).max() < rig.wrench.drift + 6 * rig.wrench.noise


def test_the_hand_goes_where_it_should_and_its_pose_is_late(messages, recorded, coarse) -> None:
    base = transforms(messages)["panda_link0"]
    poses = messages["/franka_robot_state_broadcaster/current_pose"]
    position = np.array([vector(m.pose.position) for m in poses])
    position = rotation(base.rotation).apply(position) + vector(base.translation)
    times, moving = np.arange(10_000) / 1000, slice(2500, 5500)
    errors = {}
    for late in (0.0, coarse.rig.pose_latency, 0.002):
        there = [np.interp(times - late, times, axis) for axis in recorded[1].hand.T]
        errors[late] = np.abs(position - np.transpose(there))[moving].max()
    assert errors[coarse.rig.pose_latency] < 1e-9 < 2e-5 < min(errors[0.0], errors[0.002])
    for time, expected in ((2.0, [0, 0, 0]), (7.0, [0, -0.4, 0])):
        np.testing.assert_allclose(position[round(1000 * time)], expected, atol=1.5e-3)


def test_pictures_show_the_band_where_it_is(messages, recorded) -> None:
    """Blue pixels with depth, through the camera's info and /tf_static, lie on the true band."""
    import cv2

    frames = transforms(messages)
    base, camera = frames["panda_link0"], frames["camera_color_optical_frame"]
    colors, info, _, depths = (messages[topic] for topic in PICTURES)
    k = np.array(info[0].k).reshape(3, 3)
    seen = 0
    exposures = recorded[1].lines.reshape(len(colors), INSTANTS, -1, 3)
    for color, depth, lines in list(zip(colors, depths, exposures, strict=True))[::20]:
        line = lines[INSTANTS // 2]
        if np.ptp(lines, axis=0).max() > 2e-3:
            continue  # smeared
        picture = cv2.imdecode(np.frombuffer(color.data, np.uint8), cv2.IMREAD_COLOR).astype(int)
        blue = picture[..., 0] - picture[..., 1:].max(axis=-1) > 40
        metres = cv2.imdecode(np.frombuffer(depth.data[12:], np.uint8), -1) / 1000
        rows, columns = np.nonzero(blue & (metres > 0))
        pixels = np.stack([columns, rows, np.ones(len(rows))])
        points = (np.linalg.solve(k, pixels) * metres[rows, columns]).T
        points = rotation(camera.rotation).apply(points) + vector(camera.translation)
        points = rotation(base.rotation).apply(points) + vector(base.translation)
        dense = np.concatenate(
            [np.linspace(a, b, 20) for a, b in zip(line[:-1], line[1:], strict=True)]
        )
        gaps = np.linalg.norm(points[:, None] - dense[None], axis=-1).min(axis=1)
        # its radius is 2.8 to 3.6 mm; the calibration errs by at most 1 mm + 0.1 degrees of 1 m
        assert 0.0015 < np.median(gaps) < 0.0065
        seen += len(points)
    assert seen > 500


def test_a_slippery_band_is_refused(coarse: Params, tmp_path: Path) -> None:
    slippery = with_(coarse, "rig.pads", friction=0.1)
    with pytest.raises(UserError, match="pads.friction"):
        record(slippery, "band1", tmp_path / "no.mcap", picture_scale=SCALE)
    assert not list(tmp_path.iterdir())
