"""How the hand holds a drawn band: z ahead along the pull, x along the fork.

The drawn band lies in the plane through both tips and the draw. So do the hand's z, which points
from the draw through the origin, and its x; its y, along which the fingers move, is the normal, and
they close across the band. These are the axes of a Panda's hand (panda_hand_tcp).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def along_pull(drawn: np.ndarray) -> Rotation:
    """Axes of the hand in frame O that holds the band at `drawn` (3,), off the fork's line."""
    side, ahead = np.array([1.0, 0.0, 0.0]), -drawn / np.linalg.norm(drawn)
    return Rotation.from_matrix(np.stack([side, np.cross(ahead, side), ahead], axis=1))


def quaternion(rotation: Rotation) -> np.ndarray:
    """Quaternion x, y, z, w of a rotation, with w not negative."""
    return rotation.as_quat(canonical=True)
