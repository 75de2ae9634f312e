"""Optimisers behind ask and tell, and how params.yaml names them."""

from __future__ import annotations

import inspect
from typing import Any

from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.imported import imported
from sling2sim2real.identification.search.loop import Optimizer
from sling2sim2real.settings.identification import POSTERIOR, MethodParams, OptimizerParams

OURS = {
    "design": "sling2sim2real.identification.optimizers.design.design:Design",
    "de": "sling2sim2real.identification.optimizers.de.evolution:Evolution",
    "bo": "sling2sim2real.identification.optimizers.bo.bayes:Bayes",
    "adam": "sling2sim2real.identification.optimizers.adam.adam:Adam",
}


def explorer(
    method: MethodParams, optimizer: OptimizerParams, dimension: int, rollouts: int
) -> Optimizer:
    """The optimiser that searches the whole box for a method.

    Args:
        method: params.yaml's `methods.<name>`; multistart explores by differential evolution, least
            squares by one design.
        optimizer: params.yaml's `optimizer`.
        dimension: Of the cube of the free axes.
        rollouts: How many points it will be asked for, in all.

    Raises:
        UserError: As `build`.
    """
    name = {"multistart": "de", POSTERIOR: "design"}.get(method.search, method.search)
    settings: dict[str, Any] = dict(method.settings)
    if name == "de":
        moves = {"mutation": optimizer.mutation, "recombination": optimizer.recombination}
        settings = moves | settings
    settings |= {"seed": optimizer.seed, "population": optimizer.population}
    return build(name, dimension, rollouts=rollouts, **settings)


def build(
    name: str, dimension: int, /, *, rollouts: int, seed: int, population: int, **settings
) -> Optimizer:
    """The optimiser of a name: de, bo, adam, or a class of the user's as `package.module:Class`.

    Args:
        dimension: Of the cube that it is to search.
        rollouts: How many points it will be asked for, in all.
        population: Points of the first batch.
        settings: What else its class takes.

    Raises:
        UserError: There is no such class, it takes no such settings or refuses their values, or
            it is no optimiser.
    """
    settings = {"rollouts": rollouts, "seed": seed, "population": population, **settings}
    try:
        kind = imported(OURS.get(name, name))
    except Exception as error:  # a module of the user's may raise anything
        raise _refusal(name, f"cannot be imported ({type(error).__name__}: {error})") from error
    try:
        inspect.signature(kind).bind(dimension, **settings)
    except (TypeError, ValueError) as error:
        raise _refusal(
            name, f"cannot be called as Class(dimension, {', '.join(settings)}): {error}"
        ) from error
    try:
        optimizer = kind(dimension, **settings)
    except Exception as error:  # and so may its class
        message = f"{error}" if isinstance(error, (TypeError, ValueError)) else f"{error!r}"
        raise _refusal(name, f"does not take its settings: {message}") from error
    lacking = [part for part in ("ask", "tell") if not callable(getattr(optimizer, part, None))]
    if not isinstance(getattr(optimizer, "phase", None), str):
        lacking.append("phase, a text")
    if lacking:
        raise _refusal(name, f"is no optimiser, it lacks {', '.join(lacking)}")
    return optimizer


def _refusal(name: str, what: str) -> UserError:
    return UserError(
        f"optimiser {name}: {one_line(what)}; see `search` under `methods` in params.yaml"
    )
