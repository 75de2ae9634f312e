"""Optimisers as users may write them: one that serves, and those that are refused."""

import numpy as np


class RandomSearch:
    """Uniform random points, whatever losses they get."""

    phase = "random"

    def __init__(self, dimension: int, *, rollouts: int, seed: int, population: int, batch=7):
        self._rng = np.random.default_rng(seed)
        self._shape = (batch, dimension)

    def ask(self) -> np.ndarray:
        return self._rng.random(self._shape)

    def tell(self, losses: np.ndarray) -> None:
        assert np.isfinite(losses).all()


def changed(name: str, **attributes) -> type:
    return type(name, (RandomSearch,), attributes)


def lost(self, dimension: int, **settings) -> None:
    settings["name"]  # was not given


def choosy(self, dimension: int, *, name: str = "x", **settings) -> None:
    raise ValueError(f"no such name,\nsorry: {name}")


def deaf(self, dimension: int, **settings) -> None:
    self.ask = None


Outside = changed("Outside", ask=lambda self: np.full(self._shape, 1.5))
Flat = changed("Flat", ask=lambda self: np.zeros((1, 5)))
Words = changed("Words", ask=lambda self: [["here", "there"]])
Crowd = changed("Crowd", owner=(0,))  # of one of its points it says who asked
Strangers = changed("Strangers", owner=["a"] * 7)
Nameless = changed("Nameless", phase=3)
Lost = changed("Lost", __init__=lost)
Choosy = changed("Choosy", __init__=choosy)
Deaf = type("Deaf", (), {"phase": "deaf", "__init__": deaf})
