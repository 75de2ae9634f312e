"""Robot's base, camera and fork: two of the three poses between them give the third.

Three of them close a loop, and what is left open is what they contradict each other by.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sling2sim2real.recording.input.frames import Transform

# Standard deviations of what a lab measures.
TOUCH = 0.001  # m of each fork tip, touched with the tool centre point
EYE, EYE_TURN = 0.003, math.radians(0.3)  # of a hand-eye calibration: m, rad
SURE = 3.0  # of them, from which it is no chance


@dataclass(frozen=True)
class Loop:
    """What the loop is open by.

    Attributes:
        distance: Between the two places of the fork, in the base [m].
        angle: Between its two orientations [rad].
        most_distance, most_angle: What touched tips and a calibrated camera can be off by.
    """

    distance: float
    angle: float
    most_distance: float
    most_angle: float

    @classmethod
    def of(
        cls,
        base_to_fork: Transform,
        camera_to_fork: Transform,
        base_to_camera: Transform,
        width: float,
    ) -> Loop:
        """Loop of the poses of the fork in base and camera, and of the camera in the base.

        Args:
            width: Between the fork's tips [m].
        """
        other = base_to_camera @ camera_to_fork
        away = float(np.linalg.norm(camera_to_fork.translation))
        return cls(
            float(np.linalg.norm(other.translation - base_to_fork.translation)),
            float((other.rotation.inv() * base_to_fork.rotation).magnitude()),
            SURE * math.hypot(TOUCH, EYE, EYE_TURN * away),
            SURE * math.hypot(math.sqrt(2) * TOUCH / width, EYE_TURN),
        )

    @property
    def closed(self) -> bool:
        """Whether errors of measuring explain what is left."""
        return self.distance <= self.most_distance and self.angle <= self.most_angle

    def __str__(self) -> str:
        return (
            f"the fork as seen by way of the camera lies {1e3 * self.distance:.1f} mm and"
            f" {math.degrees(self.angle):.2f} degrees off where it lies in the robot's base"
            f" (measuring explains {1e3 * self.most_distance:.0f} mm and"
            f" {math.degrees(self.most_angle):.1f} degrees)"
        )


def third(
    base: Transform | None, camera: Transform | None, between: Transform | None
) -> tuple[Transform | None, Transform | None]:
    """Base to fork's frame O and camera to it, with the one that is None by way of the others.

    Args:
        base, camera: Coordinates there to frame O.
        between: Camera to base.
    """
    if base is None and camera is not None and between is not None:
        return camera @ between.inverse(), camera
    if camera is None and base is not None and between is not None:
        return base, base @ between
    return base, camera
