"""The loop around every optimiser: it asks, its points are evaluated, it gets their losses.

An optimiser knows only the unit cube of the axes that are free. It is a class that is called as
`Class(dimension, *, rollouts, seed, population, **settings)`; search/build.py
builds it by its name in params.yaml.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluation, Penalty
from sling2sim2real.identification.search.evaluations import Evaluations


class Optimizer(Protocol):
    """Proposes points of the unit cube and learns their losses; deterministic given its seed.

    Attributes:
        phase: How its rows are called among the evaluations: de, cma, bo, adam, ...
        owner: May be left out; which of several solvers asked for each point, shape (N,).
    """

    phase: str

    def ask(self) -> np.ndarray:
        """The next points to evaluate, shape (N, D); N may differ from batch to batch."""
        ...

    def tell(self, losses: np.ndarray) -> None:
        """Their losses, finite, shape (N,), in the order of `ask`."""
        ...


def latin_hypercube(dimension: int, count: int, seed: int) -> np.ndarray:
    """Points of the unit cube, one in each of `count` strata of each axis, (count, dimension).

    SciPy's differential evolution shifts what it is given by a half and back; these points stand
    that to the last bit, so that all searches start with the very same ones.
    """
    from scipy.stats import qmc  # which takes half a second

    points = qmc.LatinHypercube(dimension, rng=np.random.default_rng(seed)).random(count)
    return (points - 0.5) + 0.5


def search(
    optimizer: Optimizer,
    evaluate: Callable[[np.ndarray], Evaluation],
    evaluations: Evaluations,
    *,
    rollouts: int,
    box: SearchBox | None = None,
) -> None:
    """Run `optimizer` until exactly `rollouts` points are evaluated; all rows go to `evaluations`.

    The last batch is cut to what is left, and the optimiser does not see a cut batch. A failed
    point gets twice the worst finite loss so far.

    Args:
        evaluate: Losses of points of the whole unit cube, shape (N, D).
        box: Whose free axes the optimiser knows; None: all of them.

    Raises:
        UserError: The optimiser asked for something else than points of the unit cube.
    """
    dimension = len(evaluations.names if box is None else box.free)
    penalty = Penalty()
    generation = 0
    while rollouts > 0:
        requested = _checked(optimizer, dimension)
        owner = _owner(optimizer, len(requested))
        unit = requested[:rollouts]
        rollouts -= len(unit)
        evaluation = evaluate(unit if box is None else box.fill(unit))
        evaluations.add(
            evaluation,
            phase=optimizer.phase,
            generation=generation,
            solver=None if owner is None else owner[: len(unit)],
        )
        generation += 1
        if len(unit) == len(requested):
            optimizer.tell(penalty(evaluation.total))


def _owner(optimizer: Optimizer, count: int) -> np.ndarray | None:
    """Which of its solvers asked for each point, shape (count,), where it says so."""
    owner = getattr(optimizer, "owner", None)
    if owner is None:
        return None
    numbers = np.asarray(owner)
    if numbers.shape != (count,) or numbers.dtype.kind != "i":
        name = type(optimizer).__name__
        raise UserError(f"{name}: owner must be {count} whole numbers, and is {owner!r:.40}")
    return numbers.astype(np.int32)


def _checked(optimizer: Optimizer, dimension: int) -> np.ndarray:
    requested = optimizer.ask()
    try:
        unit = np.array(requested, float)
    except (TypeError, ValueError):
        what = "no array of numbers"
    else:
        if unit.ndim != 2 or len(unit) == 0 or unit.shape[1] != dimension:
            what = f"shape {unit.shape}"
        elif not ((unit >= 0) & (unit <= 1)).all():
            what = "coordinates outside 0 to 1"
        else:
            return unit
    raise UserError(
        f"{type(optimizer).__name__}: ask() must give points of the unit cube, shape"
        f" (N, {dimension}), and gave {what}"
    )
