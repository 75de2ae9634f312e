"""A method of params.yaml by library calls: what it finds in episodes.

It sees episodes alone; nothing here knows the rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.machine import cores
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.identify import evaluations_of
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.posterior.confidence import confidence
from sling2sim2real.identification.posterior.identify import fit_posterior, recorded_history
from sling2sim2real.identification.posterior.launches import Evidence, Observed
from sling2sim2real.identification.results.evaluations import TERMS
from sling2sim2real.settings.identification import POSTERIOR, parameter_names
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
    evaluations = evaluations_of(params, method, Evaluator.of(params, method, episodes[0], sling))
    setup = LaunchSetup.of(params.setup, params.sling, recorded_history(sling, episodes))
    start = evaluations.best_parameters(params.methods[method].law)
    if params.methods[method].search != POSTERIOR:
        best = evaluations.best_row()
        description = {"loss": {name: best[name] for name in (*TERMS, "total")}}
        return Calibrated(sling, setup, start), description
    evidence = Evidence(observed, setup)
    density = fit_posterior(
        params, method, sling, episodes, start, evidence=evidence, workers=WORKERS
    )
    found = Calibrated(sling, setup, density.mode, density.parameters, density.samples)
    return found, confidence(density)
