"""A method of params.yaml by library calls: what it finds in episodes.

It sees episodes alone; nothing here knows the rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.machine import cores
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.identify import search_and_fit
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import TERMS, EpisodeLoss
from sling2sim2real.identification.posterior import identify as posterior
from sling2sim2real.identification.posterior.launches import Evidence, Observed
from sling2sim2real.settings.identification import parameter_names
from sling2sim2real.simulator.launch import Launches, launch
from sling2sim2real.simulator.model import ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters

WORKERS = cores()


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A method's θ of a band, and its simulator.

    Attributes:
        sling, setup: As it is launched.
        theta, samples: One sample, and those of what is known of it, or None.
        coordinates: Of these samples, shape (M, D), or None.
    """

    sling: ClampedBand
    setup: LaunchSetup
    theta: Parameters
    samples: Parameters | None = None
    coordinates: np.ndarray | None = None

    @property
    def identified(self) -> dict[str, float]:
        """What the method has looked for, by name: without samples no more than its box has."""
        names = parameter_names(self.theta.law) if self.samples is None else self.theta.names
        return {name: self.theta.sample()[name] for name in names}

    def __call__(self, draws: np.ndarray, parameters: Parameters | None = None) -> Launches:
        """Launches of draws (N, 2) with θ, or with N parameters."""
        return launch(self.sling, self.setup, parameters or self.theta, draws, workers=WORKERS)


def calibrated_by(
    params,
    method: str,
    sling: ClampedBand,
    episodes: Sequence[Episode],
    observed: Sequence[Observed] = (),
) -> tuple[Calibrated, dict]:
    """What a method finds, and says of it: least squares takes all, others the first.

    Of another search than least squares it says "loss": the terms and the total of the best.
    """
    box = SearchBox.of_method(params, method)
    loss = EpisodeLoss.of(params, method, episodes[0], sling)
    evaluate = Evaluator(episodes[0], sling, loss, box, workers=WORKERS)
    history = posterior.recorded_history(sling, episodes)
    setup = LaunchSetup.of(params.setup, params.sling, history)
    evidence = Evidence(observed, setup)
    identified = search_and_fit(
        params, method, sling, episodes, evaluate, evidence=evidence, workers=WORKERS
    )
    density = identified.density
    if density is None:
        best = identified.evaluations.best_row()
        description = {"loss": {name: best[name] for name in (*TERMS, "total")}}
        return Calibrated(sling, setup, identified.theta), description
    description = posterior.confidence(density)
    return Calibrated(sling, setup, density.mode, density.parameters, density.samples), description
