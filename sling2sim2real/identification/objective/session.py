"""What the searching stages share: an evaluator, and one that reports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from sling2sim2real.base.machine import devices, workers
from sling2sim2real.base.progress import Progress
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import launch_history
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.engine import simulate_of
from sling2sim2real.identification.objective.evaluate import Evaluation, Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.results.mounting import sling_of_method
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import OUR_ENGINE
from sling2sim2real.simulator.rubber import NEO_HOOKEAN, RUBBER


class LoggingEvaluator:
    """An evaluator that tells of each batch: its number as evaluated, and the best so far."""

    def __init__(self, evaluate: Callable[[np.ndarray], Evaluation], progress: Progress) -> None:
        self.evaluate, self.progress = evaluate, progress
        self._generation, self._best = 0, np.inf

    def __call__(self, unit: np.ndarray) -> Evaluation:
        evaluation = self.evaluate(unit)
        count, failed = len(evaluation.total), int(np.isinf(evaluation.total).sum())
        self._best = min(self._best, evaluation.total.min())
        self.progress.advance(
            count,
            f"generation {self._generation}",
            f"best {self._best:.5g}",
            f"failed {failed}/{count}",
        )
        self._generation += 1
        return evaluation


def logging_evaluator(
    title: str,
    params: Settings,
    band: str,
    method: str,
    episode: Episode,
    clamps: Path | None,
    rollouts: int,
) -> LoggingEvaluator:
    """The evaluator of a stage that has so many rollouts ahead; it says how it gets on."""
    evaluate = evaluator(params, band, method, episode, clamps)
    return LoggingEvaluator(evaluate, Progress(title, rollouts, "rollouts"))


def evaluator(
    params: Settings, band: str, method: str, episode: Episode, clamps: Path | None
) -> Evaluator:
    """The evaluator of a recorded band, on the devices that the environment names.

    Args:
        clamps: As `load_sling` has it.
    """
    engine = params.methods[method].engine
    sling = sling_of_method(params, band, method, clamps)
    return Evaluator(
        episode,
        sling,
        EpisodeLoss.of(params, method, episode, sling),
        SearchBox.of_method(params, method),
        devices=devices(),
        workers=workers(),
        simulate=simulate_of(engine),
        whole=engine != OUR_ENGINE,
    )


def law_entries(episode: Episode, law: str) -> dict:
    """What a θ file says of a law: its name, unless neo-Hookean; with memory, the pull."""
    named = {} if law == NEO_HOOKEAN else {"law": law}
    return named | ({"history": launch_history(episode)} if law == RUBBER else {})
