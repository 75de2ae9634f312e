"""Losses of a batch of parameters: simulate, compare, and say what failed.

A method's key `engine` names what simulates. Another engine than ours is a function
`simulate(band, *, episode, parameters, device) -> Rollouts` of whole batches: of a ClampedBand
(simulator/model.py) with N Parameters (simulator/parameters.py); the rollouts
(simulator/interaction.py) stay on the host.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import cast

import numpy as np

from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.imported import imported
from sling2sim2real.base.machine import device, workers
from sling2sim2real.base.progress import Progress
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.loss import TERMS, EpisodeLoss
from sling2sim2real.identification.results.theta import sling_of_method
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import ENGINES, OUR_ENGINE
from sling2sim2real.simulator.interaction import Rollouts, interact, with_recorded_pads
from sling2sim2real.simulator.model import ClampedBand

SLICE = {"cpu": 16, "cuda": 16384}  # rollouts a call: the lanes of a CPU vector; what memory holds

Simulate = Callable[..., Rollouts]
simulated: Simulate = partial(interact, fetch=False)  # the loss is computed where the rollouts are


@dataclass(frozen=True)
class Evaluation:
    """N evaluated points of a box with D axes.

    Attributes:
        unit, theta: In the unit cube, and physical values of the box's axes, shape (N, D).
        terms: Each loss term, shape (N,); NaN where the rollout failed.
        total: Weighted sum of the terms, shape (N,); +inf where the rollout failed.
        failure: None or the reason, length N.
    """

    unit: np.ndarray
    theta: np.ndarray
    terms: dict[str, np.ndarray]
    total: np.ndarray
    failure: list[str | None]


class Evaluator:
    """Evaluates points of the unit cube against one episode.

    Results ignore the number of workers: a rollout knows none of the others in its batch.
    """

    def __init__(
        self,
        episode: Episode,
        band: ClampedBand,
        loss: EpisodeLoss,
        box: SearchBox,
        *,
        device: str = "cpu",
        workers: int | None = None,
        simulate: Simulate = simulated,
        whole: bool = False,
    ) -> None:
        """Keep what every batch needs.

        Args:
            band: Its pads open as the recording shows, where that says it.
            workers: Threads on the CPU (the kernels release the interpreter); None: all cores.
            simulate: Called as `simulate(band, episode=, parameters=, device=)`.
            whole: One call a batch.
        """
        self.box, self.loss = box, loss
        self._band = with_recorded_pads(band, episode)
        self._simulate = partial(simulate, episode=episode, device=device)
        on_gpu = device.startswith("cuda")
        self._slice = sys.maxsize if whole else SLICE["cuda" if on_gpu else "cpu"]
        self._pool = ThreadPoolExecutor(1 if on_gpu else workers or os.cpu_count())

    @classmethod
    def of(
        cls,
        params: Settings,
        method: str,
        episode: Episode,
        sling: ClampedBand,
        box: SearchBox | None = None,
    ) -> Evaluator:
        """Make it for a method of params.yaml, on the device that the environment names."""
        engine = params.methods[method].engine
        return cls(
            episode,
            sling,
            EpisodeLoss.of(params, method, episode, sling),
            box or SearchBox.of_method(params, method),
            device=device(),
            workers=workers(),
            simulate=simulate_of(engine),
            whole=engine != OUR_ENGINE,
        )

    def __call__(self, unit: np.ndarray) -> Evaluation:
        """Evaluate points of the unit cube, shape (N, D)."""
        unit = np.array(unit, float)
        theta = self.box.to_physical(unit)
        slices = (theta[i : i + self._slice] for i in range(0, len(theta), self._slice))
        parts = list(self._pool.map(self._evaluate, slices))
        terms = {name: np.concatenate([part[0][name] for part in parts]) for name in TERMS}
        failure = [reason for part in parts for reason in part[1]]
        with np.errstate(invalid="ignore", over="ignore"):  # failed rollouts may hold anything
            total = self.loss.total(terms)
        failure = [
            reason or (None if finite else "the loss is not finite")
            for reason, finite in zip(failure, np.isfinite(total), strict=True)
        ]
        failed = np.array([reason is not None for reason in failure])
        terms = {name: np.where(failed, np.nan, values) for name, values in terms.items()}
        total = np.where(failed, np.inf, total)
        return Evaluation(unit, theta, terms, total, failure)

    def _evaluate(self, theta: np.ndarray) -> tuple[dict[str, np.ndarray], list[str | None]]:
        parameters = self.box.parameters(theta)
        rollouts = self._simulate(self._band, parameters=parameters)
        with np.errstate(invalid="ignore", over="ignore"):  # failed rollouts may hold anything
            return self.loss.terms(rollouts), rollouts.failure


def logging_evaluator(
    title: str,
    params: Settings,
    band: str,
    method: str,
    episode: Episode,
    clamps: Path | None,
    rollouts: int,
) -> Callable[[np.ndarray], Evaluation]:
    """The evaluator of a stage that has so many rollouts ahead; it says how it gets on.

    Args:
        title: Of the lines: stage and pair.
        clamps: As `load_sling` has it.
    """
    sling = sling_of_method(params, band, method, clamps)
    evaluate = Evaluator.of(params, method, episode, sling)
    progress, generations, best = Progress(title, rollouts, "rollouts"), count(), np.inf

    def evaluated(unit: np.ndarray) -> Evaluation:
        nonlocal best
        evaluation = evaluate(unit)
        size, failed = len(evaluation.total), int(np.isinf(evaluation.total).sum())
        best = min(best, evaluation.total.min())
        facts = f"generation {next(generations)}", f"best {best:.5g}", f"failed {failed}/{size}"
        progress.advance(size, *facts)
        return evaluation

    return evaluated


def simulate_of(engine: str) -> Simulate:
    """The function of an engine: one of ENGINES, or `package.module:function`.

    Raises UserError where there is no such function.
    """
    try:
        simulate = imported(ENGINES.get(engine, engine))
    except Exception as error:  # a module of the user's may raise anything
        message = one_line(f"{type(error).__name__}: {error}")
        raise UserError(f"engine {engine}: cannot be imported ({message})") from error
    if not callable(simulate):
        raise UserError(f"engine {engine}: must be a function; see docs/simulator.md")
    return cast(Simulate, simulate)
