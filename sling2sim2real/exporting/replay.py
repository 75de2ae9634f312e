"""What the replay of an exported chain does in any engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sling2sim2real.exporting.chain import SpringChain

HANG_S = 3.0  # s for the slack band
HandPath = Callable[[np.ndarray], np.ndarray]  # places of the hand (S, 3) from its first, (3,)


@dataclass(frozen=True)
class Shot:
    """A launch, frame O, SI units; NaN where nothing left the pouch."""

    landing: float
    speed: float
    angle: float
    hold_force: float


@dataclass(frozen=True)
class Pulled:
    """A pull while the hand holds: ends of steps (S,), force (S, 3), nodes (K, L, 3) seen."""

    time: np.ndarray
    force: np.ndarray
    line: np.ndarray


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

    def pull(self, path: HandPath, times: np.ndarray, stamps: np.ndarray) -> Pulled:
        """Take the hanging band and lead it without the projectile.

        The recorded hand is where it is, so that the arm does not give way here.

        Args:
            path: Where the held node is at `times`, given where it hung.
            times: Ends of the steps, at the time step's distance, shape (S,).
            stamps: When to look at the nodes, between `times`' ends, shape (K,).
        """
        ...
