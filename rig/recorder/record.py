"""One recording of the rig: physics, sensors and camera into a ROS 2 bag."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import interp1d
from scipy.spatial.transform import Rotation

from pipeline.params.run import PLAIN, Recording
from rig.physics.draw import sampled
from rig.physics.motion import HandMotion
from rig.physics.robot import SENSOR_LEVER, Robot
from rig.physics.scene import arm, joined, room, tube
from rig.physics.string import ElasticString
from rig.physics.world import string_of
from rig.recorder import camera as eye
from rig.recorder.camera import VirtualCamera
from rig.recorder.interaction import Interaction, hang, pull_and_release
from rig.recorder.mcap_writer import BagWriter
from rig.recorder.sensors import wrench
from sling2sim2real.base.files import replacing

if TYPE_CHECKING:
    from pipeline.params import Params
    from pipeline.params.virtual_rig import RigClock

EPOCH = 1_760_000_000_000_000_000  # ns, when the recording starts
SENSOR_RATE, GRIPPER_RATE = 1000, 50  # Hz
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]
COLOR, DEPTH = "/camera/color", "/camera/depth"
OPTICAL = "camera_color_optical_frame"
JPEG_QUALITY = 90
REPORT_EVERY = 60  # frames
INSTANTS = 5  # of each exposure at which the band is computed
PIXELS_APART, MOST_INSTANTS = 2.0, 16  # of the instants that are seen


def record(
    params: Params,
    band_name: str,
    path: Path,
    progress: Callable[[str], None] = lambda line: None,
    *,
    recording: str = PLAIN,
    picture_scale: float = 1.0,
) -> Interaction:
    """Write the recording of one band to `path` and return what truly happened.

    Args:
        recording: One of `rig.recordings`.
        picture_scale: Of the pictures' 640 x 480 pixels.
    """
    name = Recording(band=band_name, recording=recording).key
    params = sampled(params, name)
    rig, setup = params.rig, params.setup
    rng = np.random.default_rng([rig.seed, *name.encode()])
    motion_rng, sensor_rng, clock_rng, camera_rng = rng.spawn(4)
    robot = Robot.of(rig)
    string = string_of(params, band_name)
    progress(f"{band_name}: modulus {string.rubber.scale / 1e6:.3f} of its law's")

    hanging = hang(string, rig.tolerance)
    middle = hanging[string.middle]
    opening = rig.pads.opening_time, rig.pads.shape
    pulls = {"paper": (), "informative": params.plan.dips}
    dips = pulls[rig.recordings[recording].pull]
    motion = HandMotion.through(middle, rig.tracking_error, opening, motion_rng, dips)
    times = np.arange(round(motion.end * SENSOR_RATE)) / SENSOR_RATE
    phase = camera_rng.random()  # a camera's clock knows nothing of the hand's
    frames = (phase + np.arange(int(motion.end * eye.RATE - phase))) / eye.RATE
    frames = frames[camera_rng.random(len(frames)) >= rig.camera.drop_rate]
    shutter = rig.camera.exposure * np.linspace(-0.5, 0.5, INSTANTS)
    seen = np.unique(frames[:, None] + shutter)
    happened = pull_and_release(string, hanging, motion, times, seen, params, progress)

    bag = BagWriter()
    look = np.array(rig.camera.position), np.array(rig.camera.target)
    camera = VirtualCamera.looking(*look, rig.camera.focal, picture_scale)
    add_frames(bag, robot, camera.misplaced(rig.camera, camera_rng))
    clocks = clock_rng.spawn(4)
    add_gripper(bag, Clock(rig.clock, clocks[0]), motion)
    extrapolated: Any = "extrapolate"  # which SciPy's default, NaN, hides from a type checker
    late = interp1d(times, happened.hand, axis=0, fill_value=extrapolated)
    add_pose(bag, Clock(rig.clock, clocks[1]), robot, times, late(times - rig.pose_latency))
    measured = wrench(happened, robot, rig.wrench, sensor_rng)
    add_wrench(bag, Clock(rig.clock, clocks[2]), times, measured)

    clock = Clock(rig.camera.clock, clocks[3])
    still = camera.see(room(setup.fork_width, setup.fork_height, robot))
    hidden, hand = rig.bands[band_name], interp1d(times, happened.hand, axis=0)
    assert hidden is not None  # of a band of the rig
    color = hidden.color
    for i, time in enumerate(frames):
        if i % REPORT_EVERY == 0:
            progress(f"picture {i} of {len(frames)}")
        lines = happened.lines[np.searchsorted(seen, time + shutter)]
        others = arm(robot, hand(time), float(motion.finger(np.array(time))))
        instants = [
            camera.see(joined([tube(line, radius(string, line), color), others]))
            for line in instants_of(lines, camera)
        ]
        picture = eye.blurred([eye.nearer(still, instant) for instant in instants])
        add_picture(bag, clock, camera, time, picture, params, camera_rng)
    with replacing(path) as temporary:
        bag.write(temporary)
    progress(f"{path}: {path.stat().st_size / 1e6:.0f} MB")
    return happened


def instants_of(lines: np.ndarray, camera: VirtualCamera) -> np.ndarray:
    """Nodes at instants of one exposure, two pixels of their way apart and MOST_INSTANTS at most.

    Args:
        lines: Nodes at INSTANTS equal times of the exposure, shape (INSTANTS, nodes, 3).

    Returns:
        Shape (N, nodes, 3); the middle alone where nothing moves.
    """
    distance = np.linalg.norm(lines.mean(axis=(0, 1)) - camera.position)
    way = np.linalg.norm(np.diff(lines, axis=0), axis=-1).sum(axis=0).max()
    count = min(int(np.ceil(way * camera.focal / distance / PIXELS_APART)), MOST_INSTANTS)
    if count <= 1:
        return lines[INSTANTS // 2][None]
    at = (np.arange(count) + 0.5) / count * (INSTANTS - 1)
    return interp1d(np.arange(INSTANTS), lines, axis=0)(at)


def radius(string: ElasticString, line: np.ndarray) -> np.ndarray:
    """Radius of the incompressible band at its nodes [m], shape (nodes,)."""
    stretch = np.interp(
        np.arange(string.nodes), np.arange(string.edges) + 0.5, string.stretch(line)
    )
    return string.diameter / 2 / np.sqrt(stretch)


class Clock:
    """Stamps of one source, which jitter, and when its messages are received: later, in order."""

    def __init__(self, settings: RigClock, rng: np.random.Generator) -> None:
        self.settings, self.rng = settings, rng
        self.stamped = self.received = 0

    def __call__(self, time: float) -> tuple[int, int]:
        """Stamp and time of receipt [ns] of a message of `time` [s]."""
        stamp = time + self.rng.normal(0, self.settings.stamp_jitter)
        received = time + self.settings.delay + self.rng.exponential(self.settings.delay_jitter)
        self.stamped = max(EPOCH + round(stamp * 1e9), self.stamped + 1)
        self.received = max(EPOCH + round(received * 1e9), self.received)
        return self.stamped, self.received


def add_frames(bag: BagWriter, robot: Robot, believed: VirtualCamera) -> None:
    """/tf_static: fork to base to camera as calibrated, hand to force sensor."""

    def transform(parent: str, child: str, position: np.ndarray, rotation: Rotation) -> Any:
        quaternion = bag.vector(rotation.as_quat(canonical=True), "Quaternion")
        pose = bag.make("geometry_msgs/Transform", bag.vector(position), quaternion)
        return bag.make("geometry_msgs/TransformStamped", bag.header(EPOCH, parent), child, pose)

    camera = robot.in_base(believed.position), robot.base.inv() * believed.rotation
    lever = np.array([0, 0, -SENSOR_LEVER])
    frames = [
        transform("fork", "panda_link0", robot.base_position, robot.base),
        transform("panda_link0", OPTICAL, *camera),
        transform("panda_hand_tcp", "ft_sensor", lever, robot.sensor_in_tool),
    ]
    bag.add("/tf_static", bag.make("tf2_msgs/TFMessage", frames), EPOCH, EPOCH)


def add_gripper(bag: BagWriter, clock: Clock, motion: HandMotion) -> None:
    for i in range(round(motion.end * GRIPPER_RATE)):
        time = i / GRIPPER_RATE
        stamp, received = clock(time)
        fingers, velocity, effort = motion.finger(np.array(time)), np.zeros(2), np.zeros(2)
        state = np.full(2, fingers), velocity, effort
        message = bag.make("sensor_msgs/JointState", bag.header(stamp, ""), FINGERS, *state)
        bag.add("/franka_gripper/joint_states", message, stamp, received)


def add_pose(
    bag: BagWriter, clock: Clock, robot: Robot, times: np.ndarray, positions: np.ndarray
) -> None:
    orientation = bag.vector((robot.base.inv() * robot.tool).as_quat(canonical=True), "Quaternion")
    for time, position in zip(times, robot.in_base(positions), strict=True):
        stamp, received = clock(time)
        pose = bag.make("geometry_msgs/Pose", bag.vector(position, "Point"), orientation)
        message = bag.make("geometry_msgs/PoseStamped", bag.header(stamp, "panda_link0"), pose)
        bag.add("/franka_robot_state_broadcaster/current_pose", message, stamp, received)


def add_wrench(bag: BagWriter, clock: Clock, times: np.ndarray, wrenches: np.ndarray) -> None:
    for time, row in zip(times, wrenches, strict=True):
        stamp, received = clock(time)
        wrench = bag.make("geometry_msgs/Wrench", bag.vector(row[:3]), bag.vector(row[3:]))
        message = bag.make("geometry_msgs/WrenchStamped", bag.header(stamp, "ft_sensor"), wrench)
        bag.add("/ft_sensor/wrench", message, stamp, received)


def add_picture(
    bag: BagWriter,
    clock: Clock,
    camera: VirtualCamera,
    time: float,
    picture: eye.Exposure,
    params: Params,
    rng: np.random.Generator,
) -> None:
    """Colour, depth and the camera info of both."""
    import cv2

    settings = params.rig.camera
    stamp, received = clock(time)
    header = bag.header(stamp, OPTICAL)
    info = camera_info(bag, header, camera)
    color = eye.exposed(picture.color, settings, rng)[..., ::-1]
    depth = eye.measured_depth(picture, settings, rng)
    jpeg = cv2.imencode(".jpg", color, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
    huffman = [cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY]
    png = cv2.imencode(".png", depth, huffman)[1]  # noise holds nothing that a search could find
    image = partial(bag.make, "sensor_msgs/CompressedImage")
    color_topic = f"{COLOR}/image_raw/compressed"
    bag.add(color_topic, image(header, "rgb8; jpeg compressed bgr8", jpeg), stamp, received)
    bag.add(f"{COLOR}/camera_info", info, stamp, received)
    bag.add(f"{DEPTH}/camera_info", info, stamp, received)
    framed = np.concatenate([np.zeros(12, np.uint8), png])  # header: format and quantisation
    depth_topic = f"{DEPTH}/image_raw/compressedDepth"
    bag.add(depth_topic, image(header, "16UC1; compressedDepth png", framed), stamp, received)


def camera_info(bag: BagWriter, header: Any, camera: VirtualCamera) -> Any:
    (cx, cy), f = camera.center, camera.focal
    return bag.make(
        "sensor_msgs/CameraInfo",
        header=header,
        height=camera.size[1],
        width=camera.size[0],
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.array([f, 0, cx, 0, f, cy, 0, 0, 1.0]),
        r=np.eye(3).ravel(),
        p=np.array([f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1.0, 0]),
        binning_x=0,
        binning_y=0,
        roi=bag.make("sensor_msgs/RegionOfInterest", 0, 0, 0, 0, False),
    )
