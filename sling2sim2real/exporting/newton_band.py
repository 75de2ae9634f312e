"""A slingshot's band in Newton: a chain of springs between particles, held, drawn and let go.

Needs numpy, warp and newton, and a JSON file of numbers. SI units; frame: origin midway between
the fork's tips, x along the fork, y towards the target, z up.

Newton's own springs are linear, and push when they are short; a band does neither. So one kernel
adds their pull to `State.particle_f`, and SolverSemiImplicit does the rest. At a strain
e = length / rest length - 1 > 0, with l = 1 + e,

    pull = K/3 (l - l^-2) (1 - m + m/l + c (l^2 + 2/l - 3)) + K tau e'

and the second term alone where e <= 0. K is `strength_n`, m `mooney_share`, c `upturn` and tau
`damping_time_s` of the JSON file.
"""

from __future__ import annotations

import json
from pathlib import Path

import newton.solvers  # pyright: ignore[reportMissingImports]
import numpy as np
import warp as wp

# The annotations of kernels are values to Warp, and no types.
# pyright: reportInvalidTypeForm=false, reportGeneralTypeIssues=false

GRAVITY = 9.81  # m/s^2
HAND_MASS_KG = 1.0  # kg
RIGID_HAND_N_PER_M = 1e6  # N/m: of a hand that does not give way
SETTLE_S, BRAKE_PER_S = 0.25, 250.0  # s and 1/s: how long and how a drawn band is brought to rest
LONGEST_RECOIL_S = 0.5  # s from a release until nothing has left the pouch
STEPS_BETWEEN_LOOKS = 50  # steps, an even number, between two looks at what has left and landed


@wp.struct
class Numbers:
    """Numbers of all bands alike: see the JSON file."""

    edges: int
    rest: float
    node_mass: float
    projectile_mass: float
    strength: float
    share: float
    upturn: float
    damping: float
    stiffness: float
    hand_damping: float
    hand_mass: float
    gravity: float
    floor: float


@wp.func
def spring(node: wp.vec3, other: wp.vec3, v_one: wp.vec3, v_other: wp.vec3, n: Numbers):
    """Pull of a spring on its first end."""
    along = other - node
    length = wp.length(along)
    direction = along / length
    stretch = length / n.rest
    rate = wp.dot(v_other - v_one, direction) / n.rest
    pull = n.strength * n.damping * rate
    if stretch > 1.0:
        first = stretch * stretch + 2.0 / stretch - 3.0
        shape = 1.0 - n.share + n.share / stretch + n.upturn * first
        pull += n.strength / 3.0 * (stretch - 1.0 / (stretch * stretch)) * shape
    return pull * direction


@wp.kernel
def forces(
    n: Numbers,
    q: wp.array(dtype=wp.vec3),
    qd: wp.array(dtype=wp.vec3),
    hand: wp.array(dtype=wp.vec3),
    held: wp.array(dtype=wp.int32),
    loaded: wp.array(dtype=wp.int32),
    brake: wp.array(dtype=wp.float32),
    f: wp.array(dtype=wp.vec3),
    inverse_mass: wp.array(dtype=wp.float32),
    on_hand: wp.array(dtype=wp.vec3),
):
    """What acts on a particle but its weight; the middle one takes projectile and hand along."""
    i = wp.tid()
    band = i // (n.edges + 2)
    node = i % (n.edges + 2)
    total = wp.vec3(0.0)
    if node > 0 and node < n.edges:
        total = spring(q[i], q[i - 1], qd[i], qd[i - 1], n)  # pyright: ignore[reportOperatorIssue]
        total += spring(q[i], q[i + 1], qd[i], qd[i + 1], n)  # pyright: ignore[reportOperatorIssue]
        mass = n.node_mass
        if node == n.edges // 2:
            mass += float(loaded[band]) * n.projectile_mass
            on_hand[band] = total - wp.vec3(0.0, 0.0, mass * n.gravity)
            moved = mass
            if held[band] == 1:
                moved += n.hand_mass  # which is weightless
                total += n.stiffness * (hand[band] - q[i]) - n.hand_damping * qd[i]
                total += wp.vec3(0.0, 0.0, n.hand_mass * n.gravity)
            inverse_mass[i] = 1.0 / moved
        total -= brake[0] * mass * qd[i]
    f[i] = total


@wp.kernel
def carry(
    n: Numbers,
    q_before: wp.array(dtype=wp.vec3),
    f: wp.array(dtype=wp.vec3),
    held: wp.array(dtype=wp.int32),
    forward: wp.array(dtype=wp.vec3),
    loaded: wp.array(dtype=wp.int32),
    q: wp.array(dtype=wp.vec3),
    qd: wp.array(dtype=wp.vec3),
    left: wp.array(dtype=wp.vec3),
    landing: wp.array(dtype=wp.float32),
):
    """The pouch takes the projectile along, and pushes but never pulls."""
    band = wp.tid()
    ball = band * (n.edges + 2) + n.edges + 1
    middle = ball - 1 - n.edges // 2
    if loaded[band] == 1:
        q[ball] = q[middle]
        qd[ball] = qd[middle]
        if held[band] == 0 and wp.dot(f[middle], forward[band]) <= 0.0:
            loaded[band] = 0
            left[band] = qd[ball]
    elif wp.isnan(landing[band]) and q[ball][2] <= n.floor:
        part = (q_before[ball][2] - n.floor) / (q_before[ball][2] - q[ball][2])
        landing[band] = q_before[ball][1] + part * (q[ball][1] - q_before[ball][1])


class SpringBands:
    """Equal bands, each in a slingshot of its own.

    Args:
        numbers: Path of the JSON file, or what it holds.
        count: Of bands, N.
        device: As Warp names it: "cpu", "cuda:0".
    """

    def __init__(self, numbers: Path | str | dict, count: int = 1, device: str = "cpu"):
        numbers_known = (
            numbers if isinstance(numbers, dict) else json.loads(Path(numbers).read_text("utf-8"))
        )
        self.numbers, self.count, self.step_size = (
            numbers_known,
            count,
            numbers_known["time_step_s"],
        )
        n = self._n = Numbers()
        n.edges, n.floor = numbers_known["edges"], numbers_known["floor_m"]
        n.rest = numbers_known["rest_length_m"] / n.edges
        n.node_mass = numbers_known["mass_kg"] / n.edges
        n.projectile_mass = numbers_known["projectile_mass_kg"]
        n.strength = numbers_known["strength_n"]
        n.share, n.upturn = numbers_known["mooney_share"], numbers_known["upturn"]
        n.damping = numbers_known["damping_time_s"]
        n.stiffness = numbers_known["arm_stiffness_n_per_m"] or RIGID_HAND_N_PER_M
        n.hand_damping = 2 * np.sqrt(n.stiffness * HAND_MASS_KG)
        n.hand_mass, n.gravity = HAND_MASS_KG, GRAVITY
        half = numbers_known["half_width_m"]
        self.tips = np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]])

        builder = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
        masses = [0.0, *[n.node_mass] * (n.edges - 1), 0.0, n.projectile_mass]  # clamps stay
        line = straight(self.tips, np.array([0.0, -half, 0.0]), n.edges)
        places = [wp.vec3(*place) for place in (*line, line[n.edges // 2])]
        for _ in range(count):
            builder.add_particles(places, [wp.vec3(0.0)] * len(masses), masses)
        self.model = builder.finalize(device=device)
        self.model.particle_grid = None  # nothing collides
        self.solver = newton.solvers.SolverSemiImplicit(self.model)
        self.states = [self.model.state(), self.model.state()]
        self.control = self.model.control()

        vectors = {"dtype": wp.vec3, "device": device}
        self._hand, self._forward, self._left, self._on_hand = (
            wp.zeros(count, **vectors) for _ in range(4)
        )
        self._held, self._loaded = (
            wp.zeros(count, dtype=wp.int32, device=device) for _ in range(2)
        )
        self._brake = wp.zeros(1, dtype=wp.float32, device=device)
        self._landing = wp.zeros(count, dtype=wp.float32, device=device)
        self.device = device

    def draw(self, draws) -> np.ndarray:
        """Hold the bands with projectiles, at rest; hands are sent to (y, z), `draws` (N, 2).

        Returns:
            Force of each band on its hand [N], shape (N,).
        """
        places = np.insert(np.broadcast_to(draws, (self.count, 2)), 0, 0.0, axis=1)
        self.put([straight(self.tips, place, self._n.edges) for place in places])
        self.lead(places)
        self._forward.assign(-places / np.linalg.norm(places, axis=1, keepdims=True))
        self.settle(SETTLE_S)
        return np.linalg.norm(self.force, axis=1)

    def launch(self) -> tuple[np.ndarray, np.ndarray]:
        """Let go of drawn bands, until all projectiles are on the floor.

        Returns:
            Where they land, y [m], and their velocity as they leave the pouch [m/s], shapes (N,)
            and (N, 3); NaN where nothing leaves.
        """
        self._held.zero_()
        self._until(lambda: not self._loaded.numpy().any(), LONGEST_RECOIL_S)
        flying = self._loaded.numpy() == 0
        longest = 10 * LONGEST_RECOIL_S
        self._until(lambda: not np.isnan(self._landing.numpy()[flying]).any(), longest)
        left = np.where(flying[:, None], self._left.numpy(), np.nan)
        return self._landing.numpy().astype(float), left.astype(float)

    def put(self, lines, *, held: bool = True, loaded: bool = True) -> None:
        """Bands at rest through nodes (N, edges + 1, 3)."""
        lines = np.asarray(lines)
        whole = np.concatenate([lines, lines[:, [self._n.edges // 2]]], axis=1)
        for state in self.states:
            state.particle_q.assign(whole.reshape(-1, 3).astype(np.float32))
            state.particle_qd.zero_()
        self._held.fill_(int(held))
        self._loaded.fill_(int(loaded))
        self._landing.fill_(np.nan)

    def lead(self, places: np.ndarray) -> None:
        """Where hands are sent, shape (N, 3)."""
        self._hand.assign(np.asarray(places, np.float32))

    def settle(self, duration: float) -> None:
        """Brake all motion for a while."""
        self._brake.fill_(BRAKE_PER_S)
        self.run(round(duration / self.step_size / 2) * 2)
        self._brake.zero_()
        for state in self.states:
            state.particle_qd.zero_()

    @property
    def lines(self) -> np.ndarray:
        """Nodes, shape (N, edges + 1, 3)."""
        return self.states[0].particle_q.numpy().reshape(self.count, -1, 3)[:, :-1].astype(float)

    @property
    def force(self) -> np.ndarray:
        """Force of the bands on their hands in the last step, shape (N, 3)."""
        return self._on_hand.numpy().astype(float)

    def run(self, steps: int) -> None:
        """Advance by an even number of steps; the first state is the current one again."""
        now, after = self.states
        for _ in range(steps // 2):
            self.advance(now, after)
            self.advance(after, now)

    def _until(self, done, longest: float) -> None:
        for _ in range(int(longest / self.step_size / STEPS_BETWEEN_LOOKS) + 1):
            if done():
                return
            self.run(STEPS_BETWEEN_LOOKS)

    def advance(self, now: newton.State, after: newton.State) -> None:
        """One step."""
        wp.launch(
            forces,
            dim=self.model.particle_count,
            inputs=[self._n, now.particle_q, now.particle_qd, self._hand, self._held],
            outputs=[
                self._loaded, self._brake, now.particle_f, self.model.particle_inv_mass,
                self._on_hand,
            ],
            device=self.device,
        )  # fmt: skip
        self.solver.step(now, after, self.control, None, self.step_size)
        wp.launch(
            carry,
            dim=self.count,
            inputs=[self._n, now.particle_q, now.particle_f, self._held, self._forward],
            outputs=[
                self._loaded, after.particle_q, after.particle_qd, self._left, self._landing,
            ],
            device=self.device,
        )  # fmt: skip


def straight(tips: np.ndarray, place: np.ndarray, edges: int) -> np.ndarray:
    """Two straight halves from the tips to a place (3,), shape (edges + 1, 3)."""
    part = np.linspace(0, 1, edges // 2 + 1)[:, None]
    first, last = (tip + part * (place - tip) for tip in tips)
    return np.concatenate([first, last[-2::-1]])
