"""Where the robot stands, how it holds its hand, and the frames that it reports in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from pipeline.params import RigParams

SENSOR_LEVER = 0.15  # m from the force sensor to the tool centre point


@dataclass(frozen=True)
class Robot:
    """Frames of the robot, each rotation into frame O.

    Attributes:
        base_position, base: Of the robot's base (panda_link0).
        tool: Of the hand (panda_hand_tcp): x to the side, y along the fingers' motion, z ahead.
        sensor_in_tool: Of the force sensor (ft_sensor) against the hand.
    """

    base_position: np.ndarray
    base: Rotation
    tool: Rotation
    sensor_in_tool: Rotation

    @classmethod
    def of(cls, rig: RigParams) -> Robot:
        down, ahead = np.sin(rig.tool_pitch), np.cos(rig.tool_pitch)
        axes = np.array([[1.0, 0.0, 0.0], [0.0, -down, ahead], [0.0, -ahead, -down]])
        return cls(
            base_position=np.array(rig.base[:3]),
            base=Rotation.from_quat(rig.base[3:]),
            tool=Rotation.from_matrix(axes),
            sensor_in_tool=Rotation.from_euler("z", rig.wrench.yaw),
        )

    @property
    def tool_axes(self) -> np.ndarray:
        """Columns: the hand's axes in frame O, shape (3, 3)."""
        return self.tool.as_matrix()

    @property
    def sensor(self) -> Rotation:
        """The force sensor's frame into frame O."""
        return self.tool * self.sensor_in_tool

    def in_base(self, points: np.ndarray) -> np.ndarray:
        """Points of frame O (..., 3) as the robot reports them."""
        return self.base.apply(points - self.base_position, inverse=True)
