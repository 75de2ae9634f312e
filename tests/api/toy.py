"""Arrays of a rig whose hand holds a band still."""

import numpy as np


def still(time: np.ndarray, release: float) -> dict:
    """10 N towards the fork all the time; frames every tenth of a second."""
    frames = np.arange(time[0], time[-1] - 0.05, 0.1)
    return {
        "time": time,
        "position": np.tile([0.0, -0.4, 0.0], (len(time), 1)),
        "force": np.tile([0.0, 10.0, 0.0], (len(time), 1)),
        "cloud_time": frames,
        "clouds": [np.full((3, 3), 0.1)] * len(frames),
        "camera": np.array([0.8, 0.3, 0.5]),
        "grasp_time": float(time[0]) + 2.0,
        "release_time": release,
    }
