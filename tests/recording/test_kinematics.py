"""Forward kinematics against yourdfpy and a Denavit-Hartenberg table."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import kinematics
from sling2sim2real.recording.kinematics import chain_of

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


@pytest.fixture(autouse=True)
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
        ("<robot", None, "not valid XML"),
        ("<robot/>", None, "no robot with joints"),
        ('<robot xmlns:xacro="http://ros.org/xacro"><xacro:a/></robot>', None, "is a xacro"),
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
