"""Searches as users may write them: one that serves, and those that are refused."""

import numpy as np


def random_search(evaluate, dimension: int, *, rollouts: int, seed: int, population: int, batch=7):
    """Uniform random points, whatever losses they get."""
    rng = np.random.default_rng(seed)
    while True:
        assert np.isfinite(evaluate(rng.random((batch, dimension)))).all()


def outside(evaluate, dimension: int, **settings):
    evaluate(np.full((7, dimension), 1.5))


def flat(evaluate, dimension: int, **settings):
    evaluate(np.zeros((1, 5)))


def words(evaluate, dimension: int, **settings):
    evaluate([["here", "there"]])


def choosy(evaluate, dimension: int, *, name: str = "x", **settings):
    raise ValueError(f"no such name,\nsorry: {name}")
