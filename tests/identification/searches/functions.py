"""Searches of known functions of the unit cube."""

from collections.abc import Callable
from contextlib import suppress
from types import SimpleNamespace

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluation
from sling2sim2real.identification.objective.loss import TERMS
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.search import BudgetSpent, function_of, run
from sling2sim2real.identification.searches.cma_es import cma_es
from sling2sim2real.identification.searches.regions import Region, find_regions

NAMES = ("a", "b", "c", "d", "e")
CENTRE = np.array([0.3, 0.62, 0.45, 0.8, 0.55])
BUDGET = SimpleNamespace(
    seed=1,
    population=24,
    generations=12,
    mutation=(0.5, 1.0),
    recombination=0.7,
    k_top=5,
    k_nn=15,
    delta=0.1,
    cma_population=8,
    cma_rollouts=320,
)


def cube(names: tuple[str, ...]) -> SearchBox:
    """0 to 10 an axis, all of them free."""
    size = len(names)
    return SearchBox(names, np.zeros(size), np.full(size, 10.0), np.zeros(size, bool))


class Evaluate:
    """Evaluates a function of the unit cube, where each term of the loss is its value."""

    def __init__(
        self,
        function: Callable[[np.ndarray], np.ndarray],
        names: tuple[str, ...] = NAMES,
        fails: Callable[[np.ndarray], np.ndarray] = lambda unit: unit[:, 0] < 0,
        weights: dict[str, float] | None = None,
    ) -> None:
        self.function, self.fails, self.count = function, fails, 0
        self.box = cube(names)
        weights = dict.fromkeys(TERMS, 0.0) | (weights or {"geom": 1.0})
        weighed = [name for name in TERMS if weights[name]]
        total = lambda terms: sum(weights[name] * terms[name] for name in weighed)  # noqa: E731
        self.loss = SimpleNamespace(weights=weights, total=total)

    def __call__(self, unit: np.ndarray) -> Evaluation:
        self.count += 1
        value = self.function(unit)
        failed = self.fails(unit)
        terms = {name: np.where(failed, np.nan, value) for name in TERMS}
        total = np.where(failed, np.inf, self.loss.total(terms))
        failure = ["no" if bad else None for bad in failed]
        return Evaluation(unit, self.box.to_physical(unit), terms, total, failure)


def quadratic(centre: np.ndarray, matrix: np.ndarray, **more) -> Evaluate:
    """The loss is 1 + (u - centre)' matrix (u - centre) in the unit cube."""

    def value(unit: np.ndarray) -> np.ndarray:
        gap = unit - centre
        return 1 + np.einsum("ni,ij,nj->n", gap, matrix, gap)

    return Evaluate(value, **more)


def rosenbrock(unit: np.ndarray) -> np.ndarray:
    """Rosenbrock's valley on [-2, 2] an axis, shape (N,); 0 at 0.75 in the cube."""
    x = 4 * unit - 2
    return (100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2).sum(axis=1)


def changed(**changes) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(BUDGET), **changes})


def correlated() -> np.ndarray:
    """Matrix of a valley: two pairs that nearly trade off, as E and nu or s and d do."""
    matrix = np.diag([40.0, 40.0, 30.0, 30.0, 10.0])
    matrix[0, 1] = matrix[1, 0] = 38.0
    matrix[2, 3] = matrix[3, 2] = -27.0
    return matrix


def chain(evaluate, optimizer=BUDGET, names=NAMES) -> tuple[Evaluations, Evaluations, list[Region]]:
    """Explore, find regions, refine: both histories and the regions."""
    first, second = optimizer.population * (optimizer.generations + 1), optimizer.cma_rollouts
    explored = alone("de", evaluate, first, optimizer, names)
    sizes = {name: getattr(optimizer, name) for name in ("k_top", "k_nn", "delta")}
    regions = find_regions(explored.unit, explored.total, **sizes)
    refined = Evaluations("toy", explored.names)
    sizes = {"population": optimizer.cma_population, "seed": optimizer.seed}
    search = lambda losses_of: cma_es(losses_of, regions, **sizes)  # noqa: E731
    run(search, evaluate, refined, phase="cma", rollouts=second, box=cube(names))
    return explored, refined, regions


def alone(
    name: str, evaluate, rollouts: int, optimizer=BUDGET, names=NAMES, box=None, **settings
) -> Evaluations:
    """The evaluations of a search of one phase by its name."""
    box = box or cube(names)
    evaluations = Evaluations("toy", box.names)
    settings |= {"seed": optimizer.seed, "population": optimizer.population}
    phase, function = function_of(name)
    settings |= {"rollouts": rollouts}
    search = lambda losses_of: function(losses_of, len(box.free), **settings)  # noqa: E731
    run(search, evaluate, evaluations, phase=phase, rollouts=rollouts, box=box)
    return evaluations


def batches_of(
    search: Callable[..., None],
    function: Callable[[np.ndarray], np.ndarray],
    dimension: int,
    rollouts: int,
    **settings,
) -> list[np.ndarray]:
    """Batches of points that a search evaluates, by the function's own losses."""
    batches, settings = [], {"seed": 1, "population": 5} | settings

    def evaluate(unit: np.ndarray, solver: np.ndarray | None = None) -> np.ndarray:
        if sum(map(len, batches)) >= rollouts:
            raise BudgetSpent
        batches.append(np.array(unit))
        return function(unit)

    with suppress(BudgetSpent):
        search(evaluate, dimension, rollouts=rollouts, **settings)
    return batches
