"""Searches of the box of parameters: they evaluate points until their budget is spent.

A search is a function `search(evaluate, dimension, *, rollouts, seed, population, **settings)`. It
knows only the unit cube of the axes that are free, and calls `evaluate(points) -> losses` with
batches of any size; everything that it evaluates is kept, so it returns nothing. Ours lie in
searches/, and settings/identification.py names them; params.yaml names one of a user's own as
`package.module:function`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.imported import imported
from sling2sim2real.identification.objective.box import SearchBox, latin_hypercube
from sling2sim2real.identification.objective.evaluate import Evaluation
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import POSTERIOR, SEARCHES


class Evaluate(Protocol):
    """What a search calls."""

    def __call__(self, unit: np.ndarray, solver: np.ndarray | None = None) -> np.ndarray:
        """Losses (N,) of points of the unit cube (N, F); finite, a failure as twice the worst.

        Args:
            solver: Which of several solvers asked for each point, whole numbers (N,).
        """
        ...


class BudgetSpent(BaseException):
    """Ends a search from within `evaluate`. (No Exception: a search may catch those.)"""


def run(
    search: Callable[[Evaluate], None],
    evaluate: Callable[[np.ndarray], Evaluation],
    evaluations: Evaluations,
    *,
    phase: str,
    rollouts: int,
    box: SearchBox,
) -> None:
    """Run a search until `rollouts` points are evaluated, the last batch cut; all are kept.

    Args:
        evaluate: Losses of points of the whole unit cube, shape (N, D).
        evaluations: Where they are kept.
        phase: How the rows are called there.
        box: Whose free axes the search knows.

    Raises:
        UserError: The search asked for something else than points of the unit cube.
    """
    remaining, generation, worst = rollouts, 0, 0.0

    def losses_of(unit: np.ndarray, solver: np.ndarray | None = None) -> np.ndarray:
        nonlocal remaining, generation, worst
        chosen = _checked(unit, len(box.free), phase)[:remaining]
        if not remaining:
            raise BudgetSpent
        evaluation = evaluate(box.fill(chosen))
        number = None if solver is None else np.asarray(solver, np.int32)[:remaining]
        evaluations.add(evaluation, phase=phase, generation=generation, solver=number)
        remaining, generation = remaining - len(chosen), generation + 1
        if not remaining:
            raise BudgetSpent
        finite = np.isfinite(evaluation.total)
        worst = max([worst, *evaluation.total[finite]])
        return np.where(finite, evaluation.total, 2 * worst if worst else 1e6)

    try:
        search(losses_of)
    except BudgetSpent:
        pass


def _checked(unit: np.ndarray, dimension: int, name: str) -> np.ndarray:
    try:
        unit = np.array(unit, float)
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
        f"search {name}: evaluate() takes points of the unit cube, shape (N, {dimension}), and got"
        f" {what}"
    )


def rollouts_of(params: Settings, method: str) -> int:
    """How many points a method explores.

    A search of one phase has the rollouts of a refinement too: all methods spend the same.
    """
    optimizer = params.optimizer
    count = optimizer.population * (optimizer.generations + 1)
    if params.methods[method].search in ("multistart", POSTERIOR):
        return count
    return count + optimizer.cma_rollouts


def explore(
    params: Settings, method: str, evaluate: Callable[[np.ndarray], Evaluation]
) -> Evaluations:
    """Everything that the first search of a method evaluates; of most methods it is the only one.

    A multistart explores by differential evolution, least squares by one Latin hypercube.

    Args:
        evaluate: Losses of points of the whole unit cube, shape (N, D).

    Raises:
        UserError: There is no such search, it takes no such settings, or as `run`.
    """
    method_params, optimizer = params.methods[method], params.optimizer
    name, box = method_params.search, SearchBox.of_method(params, method)
    evaluations, rollouts = Evaluations(method, box.names), rollouts_of(params, method)
    phase, search = function_of(name)
    settings = {"rollouts": rollouts, "seed": optimizer.seed, "population": optimizer.population}
    if name in ("multistart", "de"):
        settings |= {"mutation": optimizer.mutation, "recombination": optimizer.recombination}
    settings |= method_params.settings
    started = lambda losses_of: search(losses_of, len(box.free), **settings)  # noqa: E731
    try:
        run(started, evaluate, evaluations, phase=phase, rollouts=rollouts, box=box)
    except (TypeError, ValueError) as error:
        if len(evaluations.total):
            raise
        raise _refusal(name, f"does not take its settings: {error}") from error
    return evaluations


def design(
    evaluate: Evaluate, dimension: int, *, rollouts: int, seed: int, population: int
) -> None:
    """Evaluate a Latin hypercube of `rollouts` points; `population` is not used."""
    evaluate(latin_hypercube(dimension, rollouts, seed))


def function_of(name: str) -> tuple[str, Callable[..., None]]:
    """What its rows are called, and the search of a name: ours, or `package.module:function`.

    Raises:
        UserError: There is no such function.
    """
    phase, place = SEARCHES.get(name, (name.rpartition(":")[2], name))
    try:
        return phase, imported(place)
    except Exception as error:  # a module of the user's may raise anything
        raise _refusal(name, f"cannot be imported ({type(error).__name__}: {error})") from error


def _refusal(name: str, what: str) -> UserError:
    return UserError(
        f"search {name}: {one_line(what)}; see `search` under `methods` in params.yaml"
    )
