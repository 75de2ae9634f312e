"""What the replay of an exported chain does in any engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sling2sim2real.exporting.chain import SpringChain


@dataclass(frozen=True)
class Shot:
    """A launch, frame O, SI units; NaN where nothing left the pouch."""

    landing: float
    speed: float
    angle: float
    hold_force: float


class ChainReplay(Protocol):
    """A chain in an engine; `engine` is its name and version."""

    chain: SpringChain
    engine: str

    @property
    def finer(self) -> ChainReplay:
        """The same replay with half the time step."""
        ...

    def launches(self, draws: np.ndarray, *, fly: bool = False) -> list[Shot]:
        """Draw to each of (N, 2) and let go.

        Args:
            fly: Whether the engine flies the projectile to the floor; else a parabola may.
        """
        ...
