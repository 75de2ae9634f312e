"""The hand's pose where it was not recorded: from joint positions by URDF.

A URDF is plain XML of which only the joints count here; `xml.etree` reads those without the meshes
and viewers that URDF packages come with. Conventions: wiki.ros.org/urdf/XML/joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.transforms import is_tool

FOLDER = Path("robots")
TURNING, SLIDING = ("revolute", "continuous"), ("prismatic",)
LEAST_AXIS = 1e-9


@dataclass(frozen=True)
class Joint:
    """One joint of a URDF; its child's frame moves from `origin` about or along `axis`."""

    name: str
    kind: str  # as the URDF says; "mimic" of one that follows another, which no arm has
    parent: str
    child: str
    rotation: Rotation
    translation: np.ndarray  # (3,) m
    axis: np.ndarray  # (3,), unit


@dataclass(frozen=True)
class Chain:
    """The joints from a robot's root to its tip.

    Attributes:
        root, tip: Links.
        joints: From root to tip, the fixed ones too.
        names: Joints whose positions are asked for, in this order.
    """

    root: str
    tip: str
    joints: tuple[Joint, ...]
    names: tuple[str, ...]

    def poses(self, positions: np.ndarray) -> np.ndarray:
        """Pose of the tip in the root, shape (S, 7): x y z qx qy qz qw.

        Args:
            positions: Of `names`, in radians or metres, shape (S, len(names)).
        """
        positions = np.asarray(positions, float)
        column = {name: positions[:, i] for i, name in enumerate(self.names)}
        turn = Rotation.from_quat(np.tile([0.0, 0, 0, 1], (len(positions), 1)))
        place = np.zeros((len(positions), 3))
        for joint in self.joints:
            place = place + turn.apply(joint.translation)
            turn = turn * joint.rotation
            if joint.kind in TURNING + SLIDING:
                motion = column[joint.name]
                if joint.kind in TURNING:
                    turn = turn * Rotation.from_rotvec(motion[:, None] * joint.axis)
                else:
                    place = place + turn.apply(motion[:, None] * joint.axis)
        return np.hstack([place, turn.as_quat()])


def chain_of(file: str, tip: str | None = None) -> Chain:
    """The chain to `tip` of the URDF robots/`file`.

    Args:
        file: params.setup.urdf.
        tip: params.setup.tip_link; None takes the one link named like a tool.

    Raises:
        UserError: in one line, where it cannot be read or has no such link.
    """
    path = FOLDER / file
    joints = _joints(path)
    parents = {joint.child: joint for joint in joints}
    links = sorted({*parents, *(joint.parent for joint in joints)})
    tip = tip or _tip(path, links, parents)
    if tip not in links:
        raise UserError(f"setup.tip_link: {path} has no link {tip!r}, it has {', '.join(links)}")
    chain: list[Joint] = []
    link = tip
    while link in parents:
        joint = parents[link]
        if len(chain) > len(joints):
            raise UserError(f"{path}: the joints above {tip} go round in a loop")
        if joint.kind not in (*TURNING, *SLIDING, "fixed"):
            raise UserError(f"{path}: joint {joint.name} is {joint.kind}, which is not supported")
        chain.insert(0, joint)
        link = joint.parent
    moving = tuple(joint.name for joint in chain if joint.kind != "fixed")
    if not moving:
        raise UserError(f"{path}: no joint moves {tip}, set setup.tip_link to the hand")
    return Chain(link, tip, tuple(chain), moving)


def _joints(path: Path) -> list[Joint]:
    try:
        robot = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError) as error:
        raise UserError(f"setup.urdf: {path}: cannot be read ({error})") from error
    joints = [element for element in robot.findall("joint") if element.find("parent") is not None]
    if robot.tag != "robot" or not joints or any("xacro" in part.tag for part in robot.iter()):
        raise UserError(
            f"setup.urdf: {path}: no robot with joints in it; expand a xacro (xacro in.xacro >"
            " out.urdf)"
        )
    try:
        return [_joint(joint) for joint in joints]
    except (KeyError, ValueError) as error:
        raise UserError(f"setup.urdf: {path}: bad joint ({error})") from error


def _joint(element: ElementTree.Element) -> Joint:
    name = element.attrib["name"]
    origin, parent, child = map(element.find, ("origin", "parent", "child"))
    if parent is None or child is None:
        raise ValueError(f"{name}: without a child or parent")
    axis = _numbers(element.find("axis"), "xyz", "1 0 0")
    length = np.linalg.norm(axis)
    if length < LEAST_AXIS:
        raise ValueError(f"{name}: axis without length")
    return Joint(
        name,
        "mimic" if element.find("mimic") is not None else element.attrib["type"],
        parent.attrib["link"],
        child.attrib["link"],
        Rotation.from_euler("xyz", _numbers(origin, "rpy", "0 0 0")),  # about fixed axes
        _numbers(origin, "xyz", "0 0 0"),
        axis / length,
    )


def _numbers(element: ElementTree.Element | None, key: str, default: str) -> np.ndarray:
    text = default if element is None else element.get(key, default)
    numbers = np.array(text.split(), float)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f'{key}="{text}" is not three numbers')
    return numbers


def _tip(path: Path, links: list[str], parents: dict[str, Joint]) -> str:
    named = [link for link in links if is_tool(link)]
    if len(named) != 1:
        ends = {joint.parent for joint in parents.values()}
        tips = named or [link for link in links if link not in ends]
        raise UserError(
            f"setup.tip_link: name the link at the tool centre point of {path}: {', '.join(tips)}"
        )
    return named[0]
