"""How long a whole search takes, method by method, on the yardstick of `sling bench`.

A search is all that the stages history and theta search, with nothing remembered. Its time
is what evaluations take (simulation, loss, keeping them) and what is left: the optimiser's own, and
of least squares the fit with its rollouts.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.base.machine import named
from pipeline.episode.episode import Episode
from pipeline.identify.identify import evaluations_of
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.cache import EvaluationCache
from pipeline.identify.objective.evaluate import Evaluator, simulated
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.posterior.identify import fit_posterior
from pipeline.identify.search.history import History
from pipeline.identify.search.loop import latin_hypercube
from pipeline.identify.search.regions import regions_asked
from pipeline.params import Params, expect_known
from pipeline.params.identification import LEAST_SQUARES, OptimizerParams
from pipeline.simulator.model import ClampedBand
from validation.benchmarks.timing import busy, others_share, seconds, shared, timed
from validation.synthetic import recorded_yardstick

LARGE = {"population": 64, "generations": 39, "cma_population": 16, "cma_rollouts": 3200}
BUDGETS = {"laptop": {}, "large": LARGE}  # ours both, the paper gives none; laptop: params.yaml's


class Clocked:
    """A callable that sums up what its calls took [s]."""

    def __init__(self, function) -> None:
        self.function, self.seconds = function, 0.0

    def __call__(self, *arguments):
        result, _, wall = timed(partial(self.function, *arguments))
        self.seconds += wall
        return result


def bench_methods(
    params: Params, device: str = "cpu", size: str = "laptop", methods: list[str] | None = None
) -> dict:
    """Time a search with each of params.yaml's methods.

    Args:
        device: Or several that share each batch, as SLING_DEVICE names them.
        size: Of the budget, laptop (params.yaml's) or large.
        methods: These alone; none or an empty list means all.

    Returns:
        `budget`: its name and settings; `batch`: seconds of one generation, simulated alone and
        with the loss; `methods`, by name: regions (0: it has none), rollouts, failures, seconds of
        the whole, CPU seconds of all threads, seconds of evaluations and of the optimiser,
        rollouts/s, best loss that was explored or refined, share of the cores that other programs
        took meanwhile.

    Raises:
        UserError: There is no such device or method.
    """
    for method in methods or ():
        expect_known(params, "method", method)
    devices = named(device, "--device")
    optimizer = params.optimizer.model_copy(update=BUDGETS[size])
    sling, episode = recorded_yardstick(params)
    first = next(iter(params.methods))
    _import_and_compile(params, sling, episode, first, devices)
    return {
        "budget": {"name": size} | {name: getattr(optimizer, name) for name in LARGE},
        "batch": _generation(params, sling, episode, first, devices, optimizer.population),
        "methods": {
            method: time_search(params, method, optimizer, sling, episode, devices)[0]
            for method in methods or params.methods
        },
    }


def time_search(
    params: Params,
    method: str,
    optimizer: OptimizerParams,
    sling: ClampedBand,
    episode: Episode,
    devices: Sequence[str],
) -> tuple[dict, History]:
    """One search from nothing, all its rollouts counted; and what it evaluated."""
    params = params.model_copy(update={"optimizer": optimizer})
    method_params = params.methods[method]
    sling = replace(sling, law=method_params.law)

    def whole(evaluate) -> tuple[History, int]:
        history = evaluations_of(params, method, evaluate)
        if method_params.search != LEAST_SQUARES:
            return history, len(history.total)
        start = history.best_parameters(method_params.law)
        fit = fit_posterior(params, method, sling, [episode], start, workers=os.cpu_count())
        return history, len(history.total) + fit.rollouts

    with tempfile.TemporaryDirectory() as folder:
        cache = EvaluationCache(
            evaluator(params, method, sling, episode, devices), Path(folder), "bench"
        )
        evaluate, before = Clocked(cache), busy()
        (history, count), cpu, wall = timed(partial(whole, evaluate))
    row = {
        "regions": regions_asked(method_params, optimizer)
        if method_params.search == "multistart"
        else 0,
        "rollouts": count,
        "failed": int(np.isinf(history.total).sum()),
        "seconds": wall,
        "cpu_seconds": cpu,
        "evaluation_s": evaluate.seconds,
        "optimizer_s": wall - evaluate.seconds,
        "rollouts_per_s": count / wall,
        "best_loss": history.best()["total"],
        "others_share": others_share(before, cpu, wall),
    }
    return row, history


def _generation(
    params: Params,
    sling: ClampedBand,
    episode: Episode,
    method: str,
    devices: Sequence[str],
    count: int,
) -> dict:
    """Seconds of one generation: simulated, and with the loss, on all cores or GPUs."""
    evaluate = evaluator(params, method, sling, episode, devices)
    unit = latin_hypercube(evaluate.box.dimension, count, params.optimizer.seed)
    parameters = evaluate.box.parameters(evaluate.box.to_physical(unit))
    simulate = partial(simulated, sling, episode, workers=os.cpu_count())
    simulation = seconds(partial(shared, devices, simulate, parameters))
    whole = seconds(partial(evaluate, unit))
    return {"rollouts": count, "simulation_s": simulation, "with_loss_s": whole}


def evaluator(
    params: Params, method: str, sling: ClampedBand, episode: Episode, devices: Sequence[str]
) -> Evaluator:
    """A method's, with nothing remembered."""
    loss = EpisodeLoss.of(params, method, episode, sling)
    return Evaluator(episode, sling, loss, SearchBox.of_method(params, method), devices=devices)


def _import_and_compile(
    params: Params, sling: ClampedBand, episode: Episode, method: str, devices: Sequence[str]
) -> None:
    """What a machine does once, and a method should not pay for."""
    import torch  # noqa: F401

    evaluate = evaluator(params, method, sling, episode, devices)
    evaluate(np.full((len(devices), evaluate.box.dimension), 0.5))


def table(result: dict) -> str:
    """What `bench_methods` found, as lines for people."""
    batch, methods = result["batch"], result["methods"]
    width = max(map(len, methods))
    heads = ("rollouts", "seconds", "evaluation", "optimizer", "rollouts/s", "best loss")
    lines = ["  ".join([" " * width, *heads])]
    for name, row in methods.items():
        values = (
            f"{row['rollouts']}",
            f"{row['seconds']:.1f}",
            f"{row['evaluation_s']:.1f}",
            f"{row['optimizer_s']:.1f}",
            f"{row['rollouts_per_s']:.0f}",
            f"{row['best_loss']:.4f}",
        )
        cells = [f"{value:>{len(head)}}" for value, head in zip(values, heads, strict=True)]
        lines.append("  ".join([f"{name:{width}}", *cells]))
    lines.append(
        f"a generation of {batch['rollouts']}: {batch['simulation_s']:.3f} s simulated,"
        f" {batch['with_loss_s']:.3f} s with the loss"
    )
    return "\n".join(lines)
