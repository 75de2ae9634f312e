"""A design: points spread over the whole box, asked for at once."""

from __future__ import annotations

import numpy as np

from sling2sim2real.identification.search.loop import latin_hypercube


class Design:
    """A Latin hypercube."""

    phase = "design"

    def __init__(self, dimension: int, *, rollouts: int, seed: int, population: int) -> None:
        """Make a Latin hypercube of `rollouts` points; `population` is not used."""
        self._points = latin_hypercube(dimension, rollouts, seed)

    def ask(self) -> np.ndarray:
        return self._points

    def tell(self, losses: np.ndarray) -> None:
        """What comes after is no search in the cube."""
