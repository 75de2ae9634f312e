"""The band as a 3D flex of MuJoCo: the recorded interaction and the launch, for comparison.

The flex's law (stable neo-Hookean, `elastic3d`) is the rod's, term by term; its Rayleigh damping is
d times the rate of the elastic stress (the projected tangent), that is damping_scale = 1. Its
`discrete` integrator is one linearised step of backward Euler, which damps like d + h: h is taken
off d. What holds a section leads it by an inertia that the band cannot move; its acceleration
shows the force on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from sling2sim2real.base.errors import UserError
from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.simulator.interaction import blend
from sling2sim2real.simulator.launch import ballistic_landing
from sling2sim2real.simulator.model import GRAVITY, ClampedBand, LaunchSetup

LED = 1e3  # kg: the inertia of what leads a vertex; a step moves it by less than a nanometre
SETTLE_STEP, SETTLE_STEPS = 0.02, 60


class FlexBand:
    """A band of MuJoCo, at rest where it hangs from its clamps.

    Attributes:
        force: Of the band on the middle section, at the end of the last step [N], shape (3,).
    """

    def __init__(self, tube: Tube, theta, step: float):
        """Args:
        theta: The five parameters; friction and damping_scale are not used.
        step: Of time [s].
        """
        mj = _mujoco()
        self.tube, self.time_step, self.force = tube, step, np.zeros(3)
        self.damping = max(float(theta[2]) - step, 0.0)
        spec = mj.MjSpec()
        spec.option.integrator = mj.mjtIntegrator.mjINT_DISCRETE
        spec.option.gravity = [0.0, 0.0, -GRAVITY]
        spec.option.iterations = 10_000  # of the linear solve: always to its tolerance
        for i, (place, mass) in enumerate(zip(tube.rest.reshape(-1, 3), tube.mass, strict=True)):
            body = spec.worldbody.add_body(name=str(i), pos=place)
            body.mass, body.inertia, body.explicitinertial = mass, [1e-9] * 3, True
            for axis in np.eye(3):
                body.add_joint(type=mj.mjtJoint.mjJNT_SLIDE, axis=axis)
        flex = spec.add_flex(name="band", dim=3, radius=0.0, elastic3d=1)
        flex.young, flex.poisson, flex.damping = theta[:3]
        flex.vertbody = [str(i) for i in range(len(tube.mass))]
        flex.vert = np.zeros(tube.rest.size)
        flex.elem = tube.tetrahedra.astype(np.int32).ravel()
        flex.contype = flex.conaffinity = flex.selfcollide = 0
        self.model = spec.compile()
        self.data, self._advance = mj.MjData(self.model), mj.mj_step
        self._led = np.zeros(tube.rest.shape, bool)
        self._led[[0, 1, -2, -1]] = True
        self.data.qpos[:] = (tube.hanging - tube.rest).ravel()
        self.settle(tube.clamped)

    @property
    def positions(self) -> np.ndarray:
        """Positions of all vertices, shape (sections, V, 3)."""
        return self.tube.rest + self.data.qpos.reshape(self.tube.rest.shape)

    @property
    def velocities(self) -> np.ndarray:
        """Velocities of all vertices, a view of shape (sections, V, 3)."""
        return self.data.qvel.reshape(self.tube.rest.shape)

    @property
    def center_line(self) -> np.ndarray:
        """Centre line of the band between the clamps, shape (L, 3)."""
        return self.positions[1:-1, 0]

    def hold(self, held: bool) -> None:
        """Lead the middle section from now on, or let it go."""
        self._led[self.tube.middle] = held

    def load(self, mass: float) -> None:
        """Spread a body of `mass` [kg] over the middle section."""
        count = self.tube.rest.shape[1]
        vertices = self.tube.middle * count + np.arange(count)
        self.model.body_mass[1 + vertices] = self.tube.mass[vertices] + mass / count

    def step(self, velocity=0.0) -> None:
        """Advance by one step; led vertices have `velocity` [m/s], which fits (sections, V, 3)."""
        velocity = np.broadcast_to(velocity, self._led.shape)
        self.velocities[self._led] = velocity[self._led]
        self.model.dof_armature[:] = LED * self._led.ravel()
        self._advance(self.model, self.data)
        acceleration = self.data.qacc.reshape(self._led.shape)
        self.force = LED * acceleration[self.tube.middle].sum(axis=0)

    def settle(self, goal: np.ndarray) -> None:
        """Come to rest with the led vertices at `goal` (sections, V, 3), led there step by step.

        Long steps without speed are Newton's method on the statics, with a little inertia.
        """
        start = self.positions
        self.model.flex_damping[:] = 0.0
        self.model.opt.timestep = SETTLE_STEP
        for k in range(SETTLE_STEPS):
            part = min(1.5 * (k + 1) / SETTLE_STEPS, 1.0)
            self.data.qvel[:] = 0.0
            self.step((start + part * (goal - start) - self.positions) / SETTLE_STEP)
        self.data.qvel[:] = 0.0
        self.model.opt.timestep = self.time_step
        self.model.flex_damping[:] = self.damping


@dataclass(frozen=True)
class FlexInteraction:
    """One simulated interaction while the hand holds the band.

    Attributes:
        times: Ends of the steps [s], shape (S,).
        force: Of the band on the hand [N], shape (S, 3).
        cloud_time: The camera's stamps between grasp and release [s], shape (K,).
        center_line: At those stamps [m], shape (K, L, 3).
        arc: Places of its points along the band at rest [m], shape (L,).
    """

    times: np.ndarray
    force: np.ndarray
    cloud_time: np.ndarray
    center_line: np.ndarray
    arc: np.ndarray


def interact(sling: ClampedBand, episode, theta, step: float = 5e-4, **mesh) -> FlexInteraction:
    """The episode's grasp, lift and pull with one theta (5,), as sling.interaction makes it.

    Args:
        mesh: As in `Tube.of`.

    Raises:
        UserError: MuJoCo is not installed.
    """
    tube = Tube.of(sling, **mesh)
    band = FlexBand(tube, theta, step)
    band.hold(True)
    count = int(round((episode.release_time - episode.grasp_time) / step))
    times = episode.grasp_time + step * np.arange(1, count + 1)
    target = hand_path(episode, times, band.positions[tube.middle, 0])
    stamps = episode.cloud_time
    stamps = stamps[(stamps > times[0]) & (stamps <= times[-1])]
    frame_steps = np.searchsorted(times, stamps)
    force, lines, speed = np.empty((count, 3)), [], np.zeros(tube.rest.shape)
    for i in range(count):
        before = band.center_line
        speed[tube.middle] = (target[i] - before[tube.middle - 1]) / step
        band.step(speed)
        force[i] = band.force
        for k in np.flatnonzero(frame_steps == i):
            weight = (stamps[k] - times[i] + step) / step
            lines.append(before + weight * (band.center_line - before))
    return FlexInteraction(times, force, stamps, np.array(lines), tube.arc)


@dataclass(frozen=True)
class FlexLaunch:
    """Outcome of one launch, as in sling.launch; NaN where the projectile never left."""

    landing_y: float
    speed: float
    angle: float
    hold_force: float
    separation_time: float


def launch(
    sling: ClampedBand, setup: LaunchSetup, theta, draw, step: float = 2.5e-4, **mesh
) -> FlexLaunch:
    """Launch the projectile, spread over the middle section, from a draw (y, z) at rest.

    It leaves where its acceleration along the launch direction no longer takes a push.

    Args:
        mesh: As in `Tube.of`.

    Raises:
        UserError: MuJoCo is not installed.
    """
    tube = Tube.of(sling, **mesh)
    band = FlexBand(tube, theta, step)
    band.hold(True)
    band.load(setup.projectile_mass)
    place = np.array([0.0, *draw])
    goal = band.positions
    goal[tube.middle] = place + tube.rest[tube.middle] * [0.0, 1.0, 1.0]
    band.settle(goal)
    hold_force = float(np.linalg.norm(band.force))
    band.hold(False)

    direction = -place / np.linalg.norm(place)
    position, velocity, contact = place, np.zeros(3), hold_force
    for i in range(int(round(setup.duration / step))):
        band.step()
        last, position = position, band.positions[tube.middle].mean(axis=0)
        old, velocity = velocity, band.velocities[tube.middle].mean(axis=0)
        push = (velocity - old) / step + [0.0, 0.0, GRAVITY]
        before, contact = contact, setup.projectile_mass * push @ direction
        if contact <= 0:
            part = before / max(before - contact, 1e-9)
            _, y, z = last + part * (position - last)
            _, vy, vz = old + part * (velocity - old)
            return FlexLaunch(
                landing_y=float(ballistic_landing(y, z, vy, vz, -setup.fork_height)),
                speed=float(np.hypot(vy, vz)),
                angle=float(np.arctan2(vz, vy)),
                hold_force=hold_force,
                separation_time=(i + part) * step,
            )
    return FlexLaunch(np.nan, np.nan, np.nan, hold_force, np.nan)


def _mujoco():
    try:
        import mujoco
    except ImportError as error:
        raise UserError("mujoco is not installed: make setup") from error
    return mujoco


def hand_path(episode, times: np.ndarray, grasp: np.ndarray) -> np.ndarray:
    """Where the held section is at `times` (S,): on the hand's path, after a blend from `grasp`.

    Returns:
        Its centre [m], shape (S, 3), as sling.interaction leads it.
    """
    inside = np.clip(times, episode.time[0], episode.time[-1])
    path = CubicSpline(episode.time, episode.position, axis=0)(inside)
    return path + blend(times, episode)[:, None] * (grasp - path[0])
