"""What the searching stages share: a pair's episode, sling and evaluator."""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.base.progress import Progress
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.session import LoggingEvaluator, evaluator
from sling2sim2real.settings import Params
from sling2sim2real.settings.run import Pair, Recording


def episode_of(recording: Recording) -> Episode:
    """The first episode of a recording. Raises NotMade."""
    return Episode.load(Layout().episode(recording))


def logging_evaluator(stage: str, pair: Pair, params: Params, rollouts: int) -> LoggingEvaluator:
    """The evaluator of a stage that has so many rollouts ahead; it says how it gets on."""
    clamps = Layout().clamps(pair)
    evaluate = evaluator(params, pair.band, pair.method, episode_of(pair), clamps)
    return LoggingEvaluator(evaluate, Progress(f"{stage}-{pair.key}", rollouts, "rollouts"))
