"""Where base, cameras and force sensor stand, by params or /tf_static.

Robot's base, camera and fork: two of the three poses between them give the third. Three of them
close a loop, and what is left open is what they contradict each other by.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.camera import Camera
from sling2sim2real.recording.streams import Recording
from sling2sim2real.recording.transforms import Transform, TransformTree, is_tool
from sling2sim2real.settings.lab import SetupParams

# Standard deviations of what a lab measures.
TOUCH = 0.001  # m of each fork tip, touched with the tool centre point
EYE, EYE_TURN = 0.003, math.radians(0.3)  # of a hand-eye calibration: m, rad
SURE = 3.0  # of them, from which it is no chance


def loop_of(
    base_to_fork: Transform, camera_to_fork: Transform, base_to_camera: Transform, width: float
) -> tuple[str, bool]:
    """What the loop of three poses is open by, in words; whether errors of measuring explain it.

    Args:
        base_to_fork, camera_to_fork, base_to_camera: Of the fork in base and camera, and of the
            camera in the base.
        width: Between the fork's tips [m].
    """
    other = base_to_camera @ camera_to_fork
    away = float(np.linalg.norm(camera_to_fork.translation))
    distance = float(np.linalg.norm(other.translation - base_to_fork.translation))
    angle = float((other.rotation.inv() * base_to_fork.rotation).magnitude())
    # What touched tips and a calibrated camera can be off by.
    far = SURE * math.hypot(TOUCH, EYE, EYE_TURN * away)
    wide = SURE * math.hypot(math.sqrt(2) * TOUCH / width, EYE_TURN)
    words = (
        f"the fork as seen by way of the camera lies {1e3 * distance:.1f} mm and"
        f" {math.degrees(angle):.2f} degrees off where it lies in the robot's base (measuring"
        f" explains {1e3 * far:.0f} mm and {math.degrees(wide):.1f} degrees)"
    )
    return words, distance <= far and angle <= wide


FORK = "fork"


@dataclass(frozen=True)
class Geometry:
    """Static transforms of one recording.

    Attributes:
        base: Frame of the pose topic to frame O.
        camera: Depth camera to frame O.
        color: Depth camera to colour camera.
        sensor: The wrench's frame to the end effector, or to frame O where `sensor_is_fixed`.
        sensor_is_fixed: The wrench is given in a frame that does not move with the hand.
        sources: Where each came from, in words.
        contradiction: Of the poses of base, camera and fork, where params and /tf_static tell all
            three and measuring does not explain it, in words.
    """

    base: Transform
    camera: Transform
    color: Transform
    sensor: Transform
    sensor_is_fixed: bool
    sources: dict[str, str]
    contradiction: str = ""


@dataclass(frozen=True)
class EpisodeGeometry:
    """What an episode keeps of its recording's geometry, for those who do not read the recording.

    Attributes:
        base_frame: Name of the pose topic's frame, the robot's base; "" where it has none.
        base_to_fork: Frame O to the base, as setup.base_to_fork.
        camera: The colour camera.
        camera_to_fork: Frame O to the colour camera, as setup.camera_to_fork.
    """

    base_frame: str
    base_to_fork: Transform
    camera: Camera
    camera_to_fork: Transform

    @classmethod
    def of(cls, recording: Recording, geometry: Geometry) -> EpisodeGeometry:
        to_color = geometry.color @ geometry.camera.inverse()
        frame, camera = recording.pose.frame, recording.color_camera
        return cls(frame, geometry.base.inverse(), camera, to_color)

    def content(self) -> dict[str, Any]:
        """Return the geometry for an episode's metadata, where it stands under `geometry`."""
        camera = asdict(self.camera)
        arrays = {key: camera[key].tolist() for key in ("matrix", "distortion")}
        return {
            "base_frame": self.base_frame,
            "base_to_fork": self.base_to_fork.pose(),
            "camera": camera | arrays,
            "camera_to_fork": self.camera_to_fork.pose(),
        }

    @classmethod
    def of_episode(cls, metadata: Mapping[str, Any], band: str) -> EpisodeGeometry:
        """Read an episode's metadata. Raises UserError where an older version made the episode."""
        content = metadata.get("geometry")
        if content is None:
            raise UserError(
                f"the episodes of {band} are of an older version, without the rig's geometry:"
                " `dvc repro` makes them anew"
            )
        camera = content["camera"]
        arrays = {key: np.array(camera[key], float) for key in ("matrix", "distortion")}
        poses = {key: Transform.of(content[key]) for key in ("base_to_fork", "camera_to_fork")}
        return cls(base_frame=content["base_frame"], camera=Camera(**camera | arrays), **poses)


def geometry_of(recording: Recording, setup: SetupParams) -> Geometry:
    """Resolve the frames; params come before /tf_static, and what both tell before what follows.

    Raises UserError where two of base, camera and fork are joined by nothing.
    """
    tree, sources = recording.transforms, {}
    pose_frame, wrench_frame = recording.pose.frame, recording.wrench.frame
    color_frame = recording.color.frame or recording.color_camera.frame
    depth_frame = recording.depth.frame or recording.depth_camera.frame

    def to_fork(name: str, frame: str, given: tuple[float, ...] | None) -> Transform | None:
        if given is not None:
            sources[name] = f"setup.{name}"
            return Transform.of(given).inverse()
        transform = tree.between(FORK, frame)
        if transform is not None:
            sources[name] = f"/tf_static {FORK} <- {frame}"
        return transform

    transforms = (
        to_fork("base_to_fork", pose_frame, setup.base_to_fork),
        to_fork("camera_to_fork", color_frame, setup.camera_to_fork),
    )
    named = pose_frame and color_frame
    between = tree.between(pose_frame, color_frame) if named else None
    base, color_to_fork = transforms
    if between is not None:
        base = base or (color_to_fork and color_to_fork @ between.inverse())
        color_to_fork = color_to_fork or (base and base @ between)
    if base is None:
        raise _missing(recording, "base_to_fork", pose_frame, color_frame)
    if color_to_fork is None:
        raise _missing(recording, "camera_to_fork", color_frame, pose_frame)
    join, odd = f"/tf_static {pose_frame} <- {color_frame}", ""
    if transforms[0] is None:
        sources["base_to_fork"] = f"{sources['camera_to_fork']}, and {join}"
    elif transforms[1] is None:
        sources["camera_to_fork"] = f"{sources['base_to_fork']}, and {join}"
    elif between is not None and any(source.startswith("setup") for source in sources.values()):
        poses = base.inverse(), color_to_fork.inverse(), between
        sources["loop"], explained = loop_of(*poses, setup.fork_width)
        odd = "" if explained else sources["loop"]
    color = _between_cameras(recording, color_frame, depth_frame)

    fixed = tree.between(pose_frame, wrench_frame) if wrench_frame else None
    if fixed is not None:
        sensor = base @ fixed
        sources["wrench"] = f"fixed frame {wrench_frame}"
    else:
        tool = _tool_frame(tree, wrench_frame, setup.tip_link)
        sensor = tree.between(tool, wrench_frame) or Transform.identity()
        sources["wrench"] = f"{wrench_frame} on {tool}, which the pose topic is taken to move"
    return Geometry(base, color_to_fork @ color, color, sensor, fixed is not None, sources, odd)


def _missing(recording: Recording, name: str, frame: str, other: str) -> UserError:
    """Neither params nor /tf_static say where the fork stands in a frame, nor by way of another."""
    has = ", ".join(recording.transforms.frames) or "nothing"
    twice = " and ".join(map(repr, sorted(recording.transforms.doubled)))
    has += f", and {twice} at two places, of which the last counts" if twice else ""
    if not frame:
        return UserError(
            f"{recording.path}: messages name no frame that /tf_static could join to"
            f" {FORK!r}: set their frame_id, or setup.{name} in params.yaml"
        )
    return UserError(
        f"{recording.path}: /tf_static does not join {frame!r} to {FORK!r} (it has {has}):"
        f" publish it, or its pose in {other!r} if the fork's is known there, or set setup.{name}"
        " in params.yaml"
    )


def _between_cameras(recording: Recording, color_frame: str, depth_frame: str) -> Transform:
    """Depth camera to colour camera; identity where the depth is registered to colour."""
    if color_frame == depth_frame:
        return Transform.identity()
    transform = recording.transforms.between(color_frame, depth_frame)
    if transform is None:
        raise UserError(
            f"{recording.path}: depth is in frame {depth_frame!r}, colour in {color_frame!r}, and"
            " /tf_static does not join the two: publish it, or record depth registered to colour"
        )
    return transform


def _tool_frame(tree: TransformTree, wrench_frame: str, tip_link: str | None) -> str:
    """PoseStamped does not say which frame moves: the tip, one named like a tool, else the root."""
    rigid = [frame for frame in tree.frames if tree.between(frame, wrench_frame) is not None]
    if tip_link in rigid:
        return tip_link
    named = [frame for frame in rigid if is_tool(frame)]
    roots = [frame for frame in rigid if tree.is_root(frame)]
    return (named or roots or [wrench_frame])[0]


def turned(rotations: Rotation) -> tuple[Rotation, float]:
    """Mean of some rotations, and the largest angle from it [rad]."""
    mean = rotations.mean()
    return mean, float((mean.inv() * rotations).magnitude().max())
