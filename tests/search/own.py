"""An optimiser as a user may write one: uniform random points, whatever they are told."""

from __future__ import annotations

import numpy as np


class RandomSearch:
    phase = "random"

    def __init__(self, dimension: int, *, rollouts: int, seed: int, population: int, batch=7):
        self._rng = np.random.default_rng(seed)
        self._shape = (batch, dimension)

    def ask(self) -> np.ndarray:
        return self._rng.random(self._shape)

    def tell(self, losses: np.ndarray) -> None:
        assert np.isfinite(losses).all()


class Outside(RandomSearch):
    """Asks beyond the cube."""

    def ask(self) -> np.ndarray:
        return super().ask() + 0.5


class Flat(RandomSearch):
    """Asks in five dimensions, whatever it was told."""

    def ask(self) -> np.ndarray:
        return np.zeros((1, 5))


class Words(RandomSearch):
    """Asks for no numbers."""

    def ask(self):
        return [["here", "there"]]


class Crowd(RandomSearch):
    """Says of one of its points who asked for it."""

    owner = (0,)


class Strangers(RandomSearch):
    """Says by names who asked."""

    @property
    def owner(self):
        return ["a"] * 7


class Halves(RandomSearch):
    """Says by halves who asked."""

    @property
    def owner(self):
        return np.full(7, 0.5)


class Lost(RandomSearch):
    """Looks for what it was not given."""

    def __init__(self, dimension: int, **settings):
        settings["name"]


class Choosy(RandomSearch):
    """Does not like what it is given."""

    def __init__(self, dimension: int, *, name: str = "x", **settings):
        raise ValueError(f"no such name,\nsorry: {name}")


class Nameless(RandomSearch):
    phase = 3


class Deaf:
    """Cannot be told."""

    phase = "deaf"

    def __init__(self, dimension: int, **settings):
        self.ask = None
