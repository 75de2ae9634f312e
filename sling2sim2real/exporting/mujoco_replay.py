"""Draw and launch the exported band in MuJoCo, with what its file holds alone."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.exporting import mjcf
from sling2sim2real.exporting.chain import Shot, SpringChain
from sling2sim2real.simulator.launch import ballistic_landing

HANG_S = 3.0  # s for the slack band
SETTLE_S, BRAKE_PER_S = 0.25, 250.0  # s and 1/s: how long and how a drawn band is brought to rest
LONGEST_RECOIL_S = 0.5  # s from a release until nothing has left the pouch


class MujocoBand:
    """A chain in MuJoCo.

    Args:
        path: Its XML file; None makes its text.
    """

    def __init__(self, chain: SpringChain, path: Path | None = None):
        mj = mujoco()
        self.chain, self.engine = chain, f"MuJoCo {version(mj.__name__)}"
        load = mj.MjModel.from_xml_path if path else mj.MjModel.from_xml_string
        self.model = load(str(path or mjcf.text("band", chain)))
        self.data, self._step = mj.MjData(self.model), mj.mj_step
        nodes = range(1, chain.edges)
        self._nodes = np.concatenate([self._dofs(f"node{i}") for i in nodes])
        self._hand, self._ball = self._dofs("hand"), self._dofs("projectile")
        self._hold, self._pouch = (self.model.equality(name).id for name in ("hold", "pouch"))
        self._start = np.array([self.model.body(f"node{i}").pos for i in nodes])
        self._ball_start = self.model.body("projectile").pos.copy()

    def _dofs(self, body: str) -> np.ndarray:
        first = self.model.joint(f"{body}_x").dofadr[0]
        return first + np.arange(3)

    @property
    def line(self) -> np.ndarray:
        """Nodes, clamps included, shape (edges + 1, 3)."""
        moved = self._start + self.data.qpos[self._nodes].reshape(-1, 3)
        return np.concatenate([self.chain.tips[:1], moved, self.chain.tips[1:]])

    @property
    def force(self) -> np.ndarray:
        """Force of the band on the hand in the last step, shape (3,)."""
        return self.data.qfrc_constraint[self._hand]

    def key(self) -> dict[str, np.ndarray]:
        """The state as a keyframe."""
        return {"qpos": self.data.qpos.copy(), "ctrl": self.data.ctrl.copy()}

    def hang(self) -> None:
        """Let the band hang at rest, beside the hand."""
        self._put(self.chain.hanging(), False, pouch=True)
        self._settle(HANG_S)
        place = self.line[self.chain.edges // 2]
        self.data.qpos[self._hand] = self.data.ctrl[:] = place

    def draw(self, draw) -> float:
        """Hold the band with the projectile at rest; the arm is sent to (y, z). Its force [N]."""
        self._put(self.chain.drawn(np.array([0.0, *draw])), True, pouch=True)
        self._settle(SETTLE_S)
        return float(np.linalg.norm(self.force))

    @property
    def finer(self) -> MujocoBand:
        """The same replay with half the time step."""
        return MujocoBand(replace(self.chain, step=self.chain.step / 2))

    def launches(self, draws: np.ndarray, *, fly: bool = False) -> list[Shot]:
        """Draw to each of (N, 2) and let go; MuJoCo flies the projectiles, or a parabola does."""
        return [self.launch(draw, fly=fly) for draw in draws]

    def launch(self, draw, *, fly: bool = False) -> Shot:
        """Draw and let go.

        Args:
            fly: Whether MuJoCo flies the projectile to the floor; else a parabola does.
        """
        hold_force = self.draw(draw)
        forward = -np.array([0.0, *draw]) / np.linalg.norm(draw)
        self.data.eq_active[self._hold] = 0
        for _ in range(round(LONGEST_RECOIL_S / self.chain.step)):
            self._step(self.model, self.data)
            if self.data.qfrc_constraint[self._ball] @ forward <= 0:  # the pouch cannot pull
                break
        else:
            return Shot(np.nan, np.nan, np.nan, hold_force)
        self.data.eq_active[self._pouch] = 0
        (_, y, z), (_, vy, vz) = self._flying()
        landing = ballistic_landing(y, z, vy, vz, self.chain.floor)
        if fly:
            landing = self._fly()
        return Shot(float(landing), float(np.hypot(vy, vz)), float(np.arctan2(vz, vy)), hold_force)

    def _flying(self) -> tuple[np.ndarray, np.ndarray]:
        """Place and velocity of the projectile, (3,) each."""
        place = self._ball_start + self.data.qpos[self._ball]
        return place, self.data.qvel[self._ball].copy()

    def _fly(self) -> float:
        """Where the projectile meets the floor, along y [m]."""
        before = after = self._flying()[0]
        while after[2] > self.chain.floor:
            before = after
            self._step(self.model, self.data)
            after = self._flying()[0]
        part = (before[2] - self.chain.floor) / (before[2] - after[2])
        return before[1] + part * (after[1] - before[1])

    def _put(self, line: np.ndarray, held: bool, pouch: bool) -> None:
        """The band at rest through nodes (edges + 1, 3), hand and projectile at its middle."""
        middle = line[self.chain.edges // 2]
        data = self.data
        data.qpos[self._nodes] = (line[1:-1] - self._start).ravel()
        data.qpos[self._hand] = data.ctrl[:] = middle
        data.qpos[self._ball] = middle - self._ball_start
        data.qvel[:] = data.qacc_warmstart[:] = 0
        data.eq_active[[self._hold, self._pouch]] = held, pouch

    def _settle(self, duration: float) -> None:
        """Brake all motion for a while."""
        dofs = np.r_[self._nodes, self._ball]
        self.model.dof_damping[dofs] = BRAKE_PER_S * self.model.dof_M0[dofs]
        self._step(self.model, self.data, nstep=round(duration / self.chain.step))
        self.model.dof_damping[dofs] = 0
        self.data.qvel[:] = 0
        self._step(self.model, self.data)


def mujoco() -> ModuleType:
    """The module. Raises UserError where it is not installed."""
    try:
        import mujoco
    except ImportError as error:
        raise UserError("mujoco is not installed: make setup") from error
    return mujoco
