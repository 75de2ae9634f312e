"""Frames that are joined, given or missing; transforms and kinematics against other libraries."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import kinematics
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.kinematics import chain_of
from sling2sim2real.recording.transforms import Transform, TransformTree

SETUP = SimpleNamespace(base_to_fork=None, camera_to_fork=None, tip_link=None, fork_width=0.275)
TURN = Rotation.from_euler("z", 30, degrees=True)
JOINED = {("fork", "base"): [0, -1, 0], ("base", "optical"): [1, 0, 0]}
ON_HAND = {("hand_tcp", "ft"): [0, 0, -0.1], ("flange", "hand_tcp"): [0, 0, 0.2]}
POINTED = {**ON_HAND, ("ft", "pointed"): [0, 0, 0.2]}


def recording(joins: dict, wrench: str = "ft", pose: str = "base", depth: str = "optical"):
    tree = TransformTree()
    for (parent, child), place in joins.items():
        tree.add(parent, child, Transform(TURN, np.array(place, float)))
    color = SimpleNamespace(frame="optical")
    return SimpleNamespace(
        path="some.mcap",
        transforms=tree,
        pose=SimpleNamespace(frame=pose),
        wrench=SimpleNamespace(frame=wrench),
        color=color,
        depth=SimpleNamespace(frame=depth),
        color_camera=color,
        depth_camera=SimpleNamespace(frame=depth),
    )


@pytest.mark.parametrize(
    ("joins", "wrench", "tip", "source"),
    [
        (ON_HAND, "ft", None, "ft on hand_tcp"),
        (POINTED, "ft", "pointed", "ft on pointed"),  # whatever else sounds like a tool
        (POINTED, "ft", "optical", "ft on hand_tcp"),  # where the sensor does not sit
        ({}, "base", None, "fixed frame base"),
    ],
)
def test_where_the_sensor_sits(joins, wrench, tip, source) -> None:
    setup = SimpleNamespace(**(vars(SETUP) | {"tip_link": tip}))
    geometry = geometry_of(recording({**JOINED, **joins}, wrench=wrench), setup)
    assert source in geometry.sources["wrench"]
    assert geometry.sensor_is_fixed == (wrench == "base")
    if tip is None and joins:
        np.testing.assert_allclose(geometry.sensor.apply([0, 0, 0.1]), [0, 0, 0], atol=1e-12)
    if wrench == "base":
        np.testing.assert_allclose(geometry.sensor.rotation.as_matrix(), TURN.as_matrix())
    camera = [np.cos(np.pi / 6), -0.5, 0]
    np.testing.assert_allclose(geometry.camera.translation, camera, atol=1e-12)


def test_a_depth_camera_of_its_own() -> None:
    apart = {**JOINED, **ON_HAND, ("optical", "depth_optical"): [-0.015, 0, 0]}
    geometry = geometry_of(recording(apart, depth="depth_optical"), SETUP)
    np.testing.assert_allclose(geometry.color.translation, [-0.015, 0, 0])
    registered = geometry_of(recording({**JOINED, **ON_HAND}), SETUP).camera
    np.testing.assert_allclose(geometry.camera.apply([0, 0, 1]), registered.apply([-0.015, 0, 1]))


def test_a_wrench_and_a_pose_without_frames_are_the_hands_and_the_bases() -> None:
    setup = SimpleNamespace(base_to_fork=(0, 1, 0, 0, 0, 0, 1), camera_to_fork=None, tip_link=None)
    geometry = geometry_of(recording({("fork", "optical"): [1, 0, 0]}, wrench="", pose=""), setup)
    assert not geometry.sensor_is_fixed
    assert geometry.sources["base_to_fork"] == "setup.base_to_fork"
    np.testing.assert_allclose(geometry.base.translation, [0, -1, 0])


PLACES = st.lists(st.floats(-2, 2), min_size=3, max_size=3)
TURNS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(
    lambda quaternion: np.linalg.norm(quaternion) > 0.1
)
POSES = st.builds(
    lambda place, turn: (*place, *(np.array(turn) / np.linalg.norm(turn))), PLACES, TURNS
)


def matrix(pose: tuple) -> np.ndarray:
    """Homogeneous, written out."""
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    return whole


def placed(edges: dict, **given):
    """The geometry with edges (parent, child): pose in /tf_static, and poses of `setup`."""
    bag = recording({})
    for edge, pose in edges.items():
        bag.transforms.add(*edge, Transform.of(pose))
    return geometry_of(bag, SimpleNamespace(**(vars(SETUP) | given)))


@given(fork=POSES, camera=POSES)
def test_any_two_of_base_camera_and_fork_give_the_third(fork, camera) -> None:
    """In params or in /tf_static, each way round; held against matrices and their inverses."""
    in_base, of_camera = matrix(fork), matrix(camera)  # of the fork, of the camera
    in_camera = np.linalg.inv(of_camera) @ in_base

    def pose(whole: np.ndarray) -> tuple:
        return (*whole[:3, 3], *Rotation.from_matrix(whole[:3, :3]).as_quat())

    base_camera = {("base", "optical"): camera}
    camera_base = {("optical", "base"): pose(np.linalg.inv(of_camera))}
    seen = pose(in_camera)
    for geometry in (
        placed(camera_base, base_to_fork=fork),
        placed(base_camera | {("other", "fork"): (0, 0, 0, 0, 0, 0, 1)}, camera_to_fork=seen),
        placed({("base", "fork"): fork}, camera_to_fork=seen),
        placed({("optical", "fork"): seen}, base_to_fork=fork),
        placed({}, base_to_fork=fork, camera_to_fork=seen),
        placed({("fork", "base"): pose(np.linalg.inv(in_base)), ("optical", "fork"): seen}),
    ):
        for transform, wanted in ((geometry.base, in_base), (geometry.camera, in_camera)):
            whole = np.eye(4)
            whole[:3, :3], whole[:3, 3] = transform.rotation.as_matrix(), transform.translation
            np.testing.assert_allclose(whole @ wanted, np.eye(4), atol=1e-9)
        assert "loop" not in geometry.sources
    whole = placed(base_camera, base_to_fork=fork, camera_to_fork=seen)
    assert "lies 0.0 mm and 0.00 degrees off" in whole.sources["loop"] and not whole.contradiction


def test_three_poses_that_contradict_each_other_say_by_how_much() -> None:
    """Setup comes first all the same; what measuring explains is no contradiction."""
    edges = {("base", "optical"): (0.7, -1.0, 0.4, 0, 0, 0, 1)}
    seen = (0.0, 1.0, 0.0, 0, 0, 0, 1)  # of the fork in the camera
    for off, turn, closed in ((0.012, 0.5, True), (0.05, 0.0, False), (0.0, 2.5, False)):
        turned = Rotation.from_euler("z", turn, degrees=True).as_quat()
        geometry = placed(edges, base_to_fork=(0.7 + off, 0, 0.4, *turned), camera_to_fork=seen)
        assert f"lies {1e3 * off:.1f} mm and {turn:.2f} degrees off" in geometry.sources["loop"]
        assert geometry.contradiction == ("" if closed else geometry.sources["loop"])
        np.testing.assert_allclose(
            geometry.base.inverse().translation, (0.7 + off, 0, 0.4), atol=1e-12
        )


def test_a_base_without_a_name_is_not_joined_to_a_camera_without_one() -> None:
    bag = recording({}, pose="")
    bag.color.frame = ""
    with pytest.raises(UserError, match="messages name no frame"):
        geometry_of(bag, SimpleNamespace(**(vars(SETUP) | {"base_to_fork": FORK_AHEAD})))


FORK_AHEAD = (0.7, 0, 0.4, 0, 0, 0, 1)


@pytest.mark.parametrize(
    ("joins", "depth", "words"),
    [
        ({}, "optical", r"does not join 'base' to 'fork' \(it has nothing\).*base_to_fork"),
        ({("fork", "base"): [0, 0, 0]}, "optical", "'optical' to 'fork'.*camera_to_fork"),
        (JOINED, "elsewhere", "depth is in frame 'elsewhere', colour in 'optical'"),
    ],
)
def test_a_missing_frame_is_one_line(joins, depth, words) -> None:
    with pytest.raises(UserError, match=words) as caught:
        geometry_of(recording(joins, depth=depth), SETUP)
    assert str(caught.value).startswith("some.mcap: ") and "\n" not in str(caught.value)


number = st.floats(-5, 5)
vectors = st.tuples(number, number, number)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: 0.1 < np.linalg.norm(q))
poses = st.tuples(vectors, quaternions).map(
    lambda pair: (*pair[0], *(np.array(pair[1]) / np.linalg.norm(pair[1])))
)


def moved(pose: tuple, point: np.ndarray) -> np.ndarray:
    """Rotate by the quaternion (u, w): v + 2 w (u x v) + 2 u x (u x v), then shift."""
    u, w = np.array(pose[3:6]), pose[6]
    twice = 2 * np.cross(u, point)
    return point + w * twice + np.cross(u, twice) + pose[:3]


@given(poses, vectors)
def test_a_pose_moves_points(pose, point) -> None:
    np.testing.assert_allclose(Transform.of(pose).apply(point), moved(pose, point), atol=1e-9)


@given(poses, poses, poses, vectors)
def test_the_tree_joins_cousins(a, b, c, point) -> None:
    tree = TransformTree()
    tree.add("root", "arm", Transform.of(a))
    tree.add("arm", "hand", Transform.of(b))
    tree.add("/root", "camera", Transform.of(c))
    in_root = moved(a, moved(b, np.array(point)))
    in_camera = tree.between("camera", "hand").apply(point)
    np.testing.assert_allclose(moved(c, in_camera), in_root, atol=1e-7)


def test_frames_that_nothing_joins() -> None:
    tree = TransformTree()
    pose = Transform.of([0, 0, 1, 0, 0, 0, 1])
    tree.add("root", "arm", pose)
    tree.add("tool", "sensor", pose)
    assert tree.between("root", "sensor") is None
    assert tree.frames == ["arm", "root", "sensor", "tool"]
    assert tree.is_root("tool") and not tree.is_root("sensor")


def test_a_loop_ends() -> None:
    tree = TransformTree()
    pose = Transform.of([0, 0, 1, 0, 0, 0, 1])
    tree.add("a", "b", pose)
    tree.add("b", "a", pose)
    assert tree.between("c", "a") is None


MIXED = """<robot name="mixed">
  <link name="world"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <link name="e"/><link name="my_tcp"/><link name="finger"/>
  <joint name="six" type="fixed"><parent link="e"/><child link="my_tcp"/>
    <origin xyz="0.01 0.02 0.3" rpy="0.4 -1.1 2.0"/></joint>
  <joint name="one" type="revolute"><parent link="world"/><child link="a"/>
    <origin xyz="0.1 -0.2 0.3" rpy="0.3 0.2 0.1"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="two" type="prismatic"><parent link="a"/><child link="b"/>
    <origin xyz="0 0.1 0.2" rpy="-0.5 0 1.2"/><axis xyz="0.36 0.48 0.8"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="three" type="continuous"><parent link="b"/><child link="c"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="four" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0.2 0 0"/>
    <axis xyz="0 2 0"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
  <joint name="five" type="revolute"><parent link="d"/><child link="e"/><origin rpy="0 1.5 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="finger_joint" type="prismatic"><parent link="e"/><child link="finger"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(kinematics, "FOLDER", tmp_path)
    return tmp_path


def matrices(poses: np.ndarray) -> np.ndarray:
    result = np.tile(np.eye(4), (len(poses), 1, 1))
    result[:, :3, :3] = Rotation.from_quat(poses[:, 3:]).as_matrix()
    result[:, :3, 3] = poses[:, :3]
    return result


def test_every_kind_of_joint_as_yourdfpy_has_it(folder) -> None:
    yourdfpy = pytest.importorskip("yourdfpy")
    file = folder / "mixed.urdf"
    file.write_text(MIXED)
    chain = chain_of("mixed.urdf")
    assert (chain.root, chain.tip) == ("world", "my_tcp")
    assert chain.names == ("one", "two", "three", "four", "five")
    other = yourdfpy.URDF.load(str(file), load_meshes=False, build_scene_graph=True)
    positions = np.random.default_rng(0).uniform(-2, 2, (20, 5))
    for row, ours in zip(positions, matrices(chain.poses(positions)), strict=True):
        other.update_cfg(dict(zip(chain.names, row, strict=True)))
        np.testing.assert_allclose(ours, other.get_transform("my_tcp", "world"), atol=1e-12)


# a, d, alpha, of Craig's convention: frankarobotics.github.io/docs/control_parameters.html
PANDA = [
    (0, 0.333, 0),
    (0, 0, -np.pi / 2),
    (0, 0.316, np.pi / 2),
    (0.0825, 0, np.pi / 2),
    (-0.0825, 0.384, -np.pi / 2),
    (0, 0, np.pi / 2),
    (0.088, 0, np.pi / 2),
]


def test_a_panda_as_its_table_has_it(folder) -> None:
    joints = []
    for i, (a, d, alpha) in enumerate(PANDA, 1):
        y, z = -d * np.sin(alpha), d * np.cos(alpha)
        joints.append(
            f'<joint name="panda_joint{i}" type="revolute"><parent link="l{i - 1}"/>'
            f'<child link="l{i}"/><origin xyz="{a} {y} {z}" rpy="{alpha} 0 0"/>'
            '<axis xyz="0 0 1"/></joint>'
        )
    (folder / "panda.urdf").write_text(f'<robot name="p">{"".join(joints)}</robot>')
    chain = chain_of("panda.urdf", "l7")
    angles = np.random.default_rng(1).uniform(-2.5, 2.5, (30, 7))
    for row, ours in zip(angles, matrices(chain.poses(angles)), strict=True):
        expected = np.eye(4)
        for (a, d, alpha), q in zip(PANDA, row, strict=True):
            c, s, ca, sa = np.cos(q), np.sin(q), np.cos(alpha), np.sin(alpha)
            expected = expected @ [
                [c, -s, 0, a],
                [s * ca, c * ca, -sa, -d * sa],
                [s * sa, c * sa, ca, d * ca],
                [0, 0, 0, 1],
            ]
        np.testing.assert_allclose(ours, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "tip", "words"),
    [
        (None, None, "cannot be read"),
        ("<robot", None, "cannot be read"),
        ("<robot/>", None, "no robot with joints"),
        ('<robot xmlns:xacro="http://ros.org/xacro"><xacro:a/></robot>', None, "expand a xacro"),
        (MIXED, "claw", "no link 'claw'"),
        (MIXED.replace("my_tcp", "claw"), None, "setup.tip_link: name the link"),
        (MIXED.replace('<axis xyz="0 0 1"/>', '<mimic joint="one"/>'), None, "three is mimic"),
        (MIXED.replace('type="continuous"', 'type="floating"'), None, "three is floating"),
        (MIXED.replace("0.36 0.48 0.8", "0 0 0"), None, "two: axis without length"),
        (MIXED.replace("0.36 0.48 0.8", "1 2"), None, "is not three numbers"),
        (MIXED.replace('<parent link="world"/>', '<parent link="my_tcp"/>'), None, "loop"),
        (MIXED, "world", "no joint moves world"),
    ],
)
def test_a_bad_urdf_is_one_line(folder, text, tip, words) -> None:
    if text is not None:
        (folder / "bad.urdf").write_text(text)
    with pytest.raises(UserError, match=words) as caught:
        chain_of("bad.urdf", tip)
    assert "\n" not in str(caught.value)
