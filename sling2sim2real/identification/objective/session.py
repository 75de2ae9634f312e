"""What the searching stages share: a band's episodes, and an evaluator that reports."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sling2sim2real.base.layout import Layout
from sling2sim2real.base.machine import devices, workers
from sling2sim2real.base.progress import Progress
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.engine import simulate_of
from sling2sim2real.identification.objective.evaluate import Evaluation, Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.results.mounting import sling_of_method
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import OUR_ENGINE


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
    stage: str, band: str, method: str, params: Settings, rollouts: int
) -> LoggingEvaluator:
    """The evaluator of a stage that has so many rollouts ahead; it says how it gets on."""
    progress = Progress(f"{stage}-{band}-{method}", rollouts, "rollouts")
    return LoggingEvaluator(evaluator(params, band, method), progress)


def evaluator(params: Settings, band: str, method: str) -> Evaluator:
    """The evaluator of a recorded band, on the devices that the environment names."""
    episode, engine = load_episode(band), params.methods[method].engine
    sling = sling_of_method(params, band, method)
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


def load_episode(band: str) -> Episode:
    """The first recorded episode of a band. Raises NotMade."""
    return Episode.load(Layout().episode(band))


def load_episodes(band: str) -> list[Episode]:
    """All of a band. Raises NotMade."""
    return Episode.load_all(Layout().episodes(band))
