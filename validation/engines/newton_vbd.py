"""Bands as tetrahedra of Newton, stepped by vertex block descent: for their speed and force.

The law is the rod's; the damping (a rate of Green strain) takes d times mu / 2, its value at rest.
Needs no MuJoCo, and runs wherever the simulator and Newton do, on a CPU or with CUDA.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from pipeline.base.errors import UserError
from pipeline.export.mesh import Tube
from pipeline.simulator.model import GRAVITY


@wp.kernel
def _lead(
    path: wp.array(dtype=wp.vec3),
    place: wp.array(dtype=wp.int32),
    vertices: wp.array(dtype=wp.int32),
    offset: wp.array(dtype=wp.vec3),
    positions: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    last = path.shape[0] - 1
    positions[vertices[i]] = path[wp.min(place[0], last)] + offset[i]


@wp.kernel
def _next(place: wp.array(dtype=wp.int32)):
    place[0] = place[0] + 1


class Bands:
    """N equal bands of Newton, hanging in a U from their clamps, their middles held.

    Attributes:
        tube: The mesh of each.
    """

    def __init__(
        self,
        tube: Tube,
        theta,
        count: int,
        path: np.ndarray,
        *,
        step: float,
        iterations: int,
        device: str = "cpu",
    ):
        """Args:
        path: Where the hand is at the end of each step [m], shape (S, 3).
        step: Of time [s].
        iterations: Sweeps over all vertices a step.

        Raises:
            UserError: Newton is not installed.
        """
        newton = _newton()
        young, poisson, damping = map(float, theta[:3])
        self.tube, self.theta = tube, theta
        mu = young / (2 * (1 + poisson))
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
        builder.add_soft_mesh(
            pos=wp.vec3(0.0),
            rot=wp.quat_identity(),
            scale=1.0,
            vel=wp.vec3(0.0),
            vertices=[wp.vec3(*v) for v in tube.rest.reshape(-1, 3)],
            indices=tube.tetrahedra.ravel().tolist(),
            density=1.0,
            k_mu=mu,
            k_lambda=young * poisson / ((1 + poisson) * (1 - 2 * poisson)),
            k_damp=damping * mu / 2,
            add_surface_mesh_edges=False,
        )
        held = np.zeros(tube.rest.shape[:2], bool)
        held[[0, 1, tube.middle, -2, -1]] = True
        builder.particle_mass[:] = np.where(held.ravel(), 0.0, tube.mass).tolist()
        builder.color()
        many = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
        many.replicate(builder, count)
        self.model = many.finalize(device=device)
        self.solver = newton.solvers.SolverVBD(self.model, iterations=iterations)
        self.states = [self.model.state(), self.model.state()]
        self.control, self.step_size, self.device = self.model.control(), step, device
        start = np.tile(tube.clamped.reshape(-1, 3), (count, 1)).astype(np.float32)
        self.states[0].particle_q.assign(start)

        section = tube.middle * tube.rest.shape[1] + np.arange(tube.rest.shape[1])
        every = (np.arange(count)[:, None] * tube.mass.size + section).ravel()
        offset = np.tile(tube.rest[tube.middle] * [0.0, 1.0, 1.0], (count, 1))
        self._hand = (
            wp.array(path.astype(np.float32), dtype=wp.vec3, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            wp.array(every.astype(np.int32), device=device),
            wp.array(offset.astype(np.float32), dtype=wp.vec3, device=device),
        )
        self._graph = None

    def run(self, steps: int) -> None:
        """Advance by an even number of steps along the path; returns when they are done."""
        if self.device.startswith("cuda"):
            if self._graph is None:
                self._pair()  # compiles, which no capture may
                steps -= 2
                with wp.ScopedCapture(self.device) as capture:
                    self._pair()
                self._graph = capture.graph
            for _ in range(steps // 2):
                wp.capture_launch(self._graph)
        else:
            for _ in range(steps // 2):
                self._pair()
        wp.synchronize_device(self.device)

    def _pair(self) -> None:
        """Two steps, after which the first state is the current one again."""
        path, place, vertices, offset = self._hand
        for now, after in (self.states, self.states[::-1]):
            wp.launch(
                _lead,
                dim=len(vertices),
                inputs=[path, place, vertices, offset, now.particle_q],
                device=self.device,
            )
            wp.launch(_next, dim=1, inputs=[place], device=self.device)
            self.solver.step(now, after, self.control, None, self.step_size)

    def positions(self) -> np.ndarray:
        """Positions of all vertices, shape (N, sections, V, 3)."""
        return self.states[0].particle_q.numpy().reshape(-1, *self.tube.rest.shape)

    def forces(self) -> np.ndarray:
        """Elastic force of each band on its hand [N], shape (N, 3)."""
        forces = [self.tube.elastic_force(band, self.theta) for band in self.positions()]
        return np.array(forces)[:, self.tube.middle].sum(axis=1)


def _newton():
    try:
        import newton
        import newton.solvers
    except ImportError as error:
        cure = "pip install -e '.[export]' -c constraints.txt"
        raise UserError(f"newton is not installed: {cure}") from error
    return newton
