"""Draw and launch the exported band in Newton, with what its files hold alone."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import version
from types import ModuleType

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.exporting.chain import Shot, SpringChain


def numbers(name: str, chain: SpringChain, draws: np.ndarray) -> dict:
    """What the JSON file holds; `draws` (N, 2) are for an example."""
    return {
        "name": name,
        "edges": chain.edges,
        "rest_length_m": chain.rest_length,
        "mass_kg": chain.mass,
        "half_width_m": chain.half_width,
        "floor_m": chain.floor,
        "projectile_mass_kg": chain.projectile_mass,
        "arm_stiffness_n_per_m": chain.arm_stiffness,
        "strength_n": chain.strength,
        "mooney_share": chain.mooney_share,
        "upturn": chain.upturn,
        "damping_time_s": chain.damping_time,
        "largest_strain": chain.largest_strain,
        "time_step_s": chain.step,
        "draws_m": np.asarray(draws).tolist(),
    }


def sample(chain: SpringChain) -> dict[str, float]:
    """What a sample changes of them."""
    changed = "strength_n", "mooney_share", "damping_time_s", "time_step_s"
    known = numbers("", chain, np.empty((0, 2)))
    return {name: known[name] for name in changed}


class NewtonReplay:
    """A chain in Newton. Raises UserError where Newton is not installed.

    Attributes:
        device: As Warp names it.
    """

    def __init__(self, chain: SpringChain, device: str = "cpu"):
        self.chain, self._module, self.device = chain, loader(), device
        place = "CPU" if device == "cpu" else "GPU"
        self.engine = f"Newton {version('newton')}, Warp {version('warp-lang')}, {place}"
        self._numbers = numbers("band", chain, np.empty((0, 2)))

    @property
    def finer(self) -> NewtonReplay:
        """The same replay with half the time step."""
        return NewtonReplay(replace(self.chain, step=self.chain.step / 2), self.device)

    def launches(self, draws: np.ndarray, *, fly: bool = True) -> list[Shot]:
        """Draw to each of (N, 2) and let go, all at once; Newton always flies them."""
        bands = self._module.SpringBands(self._numbers, len(draws), self.device)
        hold_force = bands.draw(draws)
        landing, left = bands.launch()
        speed, angle = np.linalg.norm(left, axis=1), np.arctan2(left[:, 2], left[:, 1])
        columns = np.stack([landing, speed, angle, hold_force], axis=1)
        return [Shot(*row) for row in columns.tolist()]


def loader() -> ModuleType:
    """sling2sim2real.exporting.newton_band. Raises UserError where Newton is not installed."""
    try:
        from sling2sim2real.exporting import newton_band
    except ImportError as error:
        raise UserError(
            "newton is not installed: pip install -e '.[export]' -c constraints.txt"
        ) from error
    return newton_band
