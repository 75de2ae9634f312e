"""What the searching stages share: an evaluator that reports, and remembers what it simulated."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np

from pipeline.base.fingerprint import fingerprint
from pipeline.base.layout import Layout
from pipeline.base.machine import devices, kind, workers
from pipeline.base.progress import Progress
from pipeline.episode.episode import Episode
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.cache import EvaluationCache
from pipeline.identify.objective.engine import simulate_of, sources_of
from pipeline.identify.objective.evaluate import Evaluation, Evaluator
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.results.mounting import sling_of_method
from pipeline.params import Params
from pipeline.params.identification import OUR_ENGINE, MethodParams

PIPELINE = Path(__file__).parents[2]
SOURCES = (  # the code that a term of the loss depends on
    *(PIPELINE / name for name in ("episode", "identify/objective", "simulator")),
    *(PIPELINE / "base" / name for name in ("failures.py", "minimum_jerk.py", "native.py")),
)


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
            seconds=evaluation.seconds,
        )
        self._generation += 1
        return evaluation


def logging_evaluator(
    stage: str, band: str, method: str, params: Params, rollouts: int
) -> LoggingEvaluator:
    """The evaluator of a stage that has so many rollouts ahead; it says how it gets on."""
    evaluate, layout = evaluator(params, band, method), Layout()
    sections = (params.bands[band], params.setup, params.sling, params.force, params.loss)
    cache = EvaluationCache(
        evaluate,
        Path(".checkpoints", "-".join(_folder(band, params.methods[method]))),
        fingerprint(
            *SOURCES,
            *(layout.episode(band) / f"{name}.parquet" for name in ("signals", "clouds")),
            layout.clamps(band),
            *sources_of(params.methods[method].engine),
            *(section.model_dump_json() for section in sections),
            *(f"{package} {version(package)}" for package in ("warp-lang", "numpy", "scipy")),
            kind(),  # of the devices, not how many: that changes nothing
        ),
    )
    return LoggingEvaluator(cache, Progress(f"{stage}-{band}-{method}", rollouts, "rollouts"))


def _folder(band: str, method: MethodParams) -> list[str]:
    """Words that tell methods apart whose rollouts differ."""
    words = [band] if method.mounting else [band, "unmounted"]
    return words if method.engine == OUR_ENGINE else [*words, method.engine.replace(":", ".")]


def evaluator(params: Params, band: str, method: str) -> Evaluator:
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
