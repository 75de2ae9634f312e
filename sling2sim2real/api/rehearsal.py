"""A rehearsed recording: what sensors would see of a pull, if the simulator were the world."""

from __future__ import annotations

import numpy as np

from sling2sim2real.api.model import Model
from sling2sim2real.api.simulation import pull, simulate
from sling2sim2real.base.errors import UserError

RATE = 1000.0  # Hz, of the force and of the hand
POINTS = 4  # an edge and a frame


def rehearse(
    model: Model,
    draw: tuple[float, float] = (-0.40, 0.0),
    *,
    dips: bool = False,
    force_noise: float = 0.05,
    depth_noise: float = 0.001,
    seed: int = 0,
) -> dict[str, object]:
    """Arrays of a planned pull, as `episode_from_arrays` takes them: simulated, with noise.

    To try an analysis before there is a recording. The simulator is the world here, so it is found
    again better than any real band; the project's virtual rig (docs/rig.md) is not so kind.

    >>> from sling2sim2real import Band, Model, Settings, Theta, rehearse
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
    >>> arrays = rehearse(model, draw=(-0.35, -0.10))
    >>> arrays["force"].shape, len(arrays["clouds"])
    ((4950, 3), 148)

    Args:
        model: The world.
        draw: Where the hand draws the band to (y, z), frame O [m].
        dips: Whether the hand lets the band back on its way, as `pull` has it.
        force_noise: Standard deviation of a force sample [N].
        depth_noise: Of a point of a cloud along each axis [m].
        seed: Of the noise.

    Raises:
        UserError: The simulation fails.
    """
    planned, rng = pull(model, draw, dips=dips), np.random.default_rng(seed)
    simulated = simulate(model, planned)
    if simulated.failure:
        raise UserError(f"rehearse: {simulated.failure}")
    time = np.arange(planned.time[0], planned.time[-1], 1 / RATE)

    def at(times: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(time, times, axis) for axis in values.T], axis=1)

    force = at(simulated.step_time, simulated.step_force)
    force[time < planned.grasp_time] = 0.0
    clouds = [_cloud(model, line, planned.camera, rng) for line in simulated.center_line]
    return {
        "time": time,
        "position": at(planned.time, planned.position),
        "force": force + rng.normal(0, force_noise, force.shape),
        "cloud_time": planned.cloud_time,
        "clouds": [cloud + rng.normal(0, depth_noise, cloud.shape) for cloud in clouds],
        "camera": planned.camera,
        "grasp_time": planned.grasp_time,
        "release_time": planned.release_time,
    }


def _cloud(model: Model, line: np.ndarray, camera: np.ndarray, rng) -> np.ndarray:
    """Points (P, 3) of the half of a tube around a centre line (L, 3) that faces the camera."""
    step = np.repeat(np.diff(line, axis=0), POINTS, axis=0)
    start = np.repeat(line[:-1], POINTS, axis=0)
    length = np.linalg.norm(step, axis=1, keepdims=True)
    rest = np.repeat(model.sling.edge_lengths, POINTS)[:, None]
    center, tangent = start + rng.random((len(step), 1)) * step, step / length
    front = camera - center
    front -= np.sum(front * tangent, axis=1, keepdims=True) * tangent
    front /= np.linalg.norm(front, axis=1, keepdims=True)
    angle = rng.uniform(-np.pi / 2, np.pi / 2, (len(step), 1))
    around = np.cos(angle) * front + np.sin(angle) * np.cross(tangent, front)
    return center + model.sling.radius * np.sqrt(rest / length) * around
