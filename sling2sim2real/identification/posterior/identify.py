"""A band's parameters from its recordings and launches.

One density: its mode is θ*, its samples the intervals. With several recordings it is as wide as
they differ (Birge's ratio, Phys. Rev. 40, 1932): their disagreement beyond what each leaves
open is the model's discrepancy, and no other is assumed but the returned share's prior.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.base.machine import cores
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import deepest_draw, launch_history
from sling2sim2real.episode.signal import cutoff_hz
from sling2sim2real.identification.posterior.coordinates import Coordinates
from sling2sim2real.identification.posterior.fit import Fit, fit, held, widened
from sling2sim2real.identification.posterior.launches import Evidence, LaunchLikelihood
from sling2sim2real.identification.posterior.likelihood import SIMULATED, Failed, Likelihood
from sling2sim2real.identification.posterior.residuals import BINS, LEAST_POINTS
from sling2sim2real.identification.posterior.sampling import SAMPLES, Remaining, samples_of
from sling2sim2real.identification.results.ranges import at_edges
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import parameter_names
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import RUBBER

WORTH_WIDENING = 1.2  # times the usual spread: less changes no interval by much


@dataclass(frozen=True)
class Identified:
    """What is known of a band.

    Attributes:
        coordinates, fit: The density, and its mode.
        birge: By what the recordings' disagreement widens the evidence's standard deviations; 1
            for one. Priors stay as they are.
        samples: Of the coordinates, within bounds, shape (SAMPLES, D).
        effective, batches: How many samples of even weight these are worth, and how many batches
            of SAMPLES rollouts they took of each recording.
        recordings, launches: The evidence.
        edges: Parameters of θ at an end of their bounds, and which: the true value may lie outside.
    """

    coordinates: Coordinates
    fit: Fit
    birge: float
    samples: np.ndarray
    effective: float
    batches: int
    recordings: list[Likelihood]
    launches: LaunchLikelihood | None
    edges: dict[str, str]

    @property
    def settled(self) -> bool:
        """Whether the fit has settled, and not at an edge."""
        return self.fit.settled and not self.edges

    @property
    def density(self) -> Fit:
        """The Gaussian around the mode, as wide as the recordings differ."""
        return widened(self.fit, self.coordinates, self.birge)

    @property
    def mode(self) -> Parameters:
        """θ*, one sample."""
        return self.coordinates.parameters(self.fit.phi[None])

    @property
    def parameters(self) -> Parameters:
        """Parameters of the SAMPLES samples."""
        return self.coordinates.parameters(self.samples)

    @property
    def rollouts(self) -> int:
        """Simulated interactions of the fit, and of the samples."""
        each = len(self.coordinates.names) + len(SIMULATED)  # with the mode, without the clock
        return len(self.recordings) * (self.fit.steps * each + self.batches * SAMPLES)


def fit_posterior(
    params: Settings,
    method: str,
    sling: ClampedBand,
    episodes: Sequence[Episode],
    start: Parameters,
    *,
    evidence: Evidence | None = None,
    workers: int | None = None,
    progress: Callable[[Fit], None] = lambda fit: None,
) -> Identified:
    """Fit the density of a band.

    Args:
        method: Of params.yaml, one that searches by least squares.
        episodes: Of the band's recordings, at least one.
        start: One sample: the nearest that an exploration found.
        evidence: Launches, drawn as the first recording was, one after the other, after all
            recordings.

    Raises:
        NoFit: Simulations fail at the start.
        UserError: A recording shows no band.
    """
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    friction = params.methods[method].fixed["dynamic_friction"]
    recordings = [Likelihood(episode, sling, cutoff, friction) for episode in episodes]
    coordinates = Coordinates.of_method(params, method, sling)
    launches = None
    if evidence and evidence.launches:
        setup = replace(evidence.setup, history=recorded_history(sling, episodes))
        launches = LaunchLikelihood(evidence.launches, sling, setup, workers or cores())
    options = {"launches": launches, "workers": workers, "progress": progress}
    begin = coordinates.of(start)
    nearest = coordinates.parameters(begin[None])
    try:
        recordings = [recording.aligned(nearest) for recording in recordings]
    except Failed:
        pass  # the fit says why
    alike = sum(recording.shows_recoil for recording in recordings)
    recordings = [recording.among(max(alike, 1)) for recording in recordings]
    fitted = fit(recordings, coordinates, begin, **options)
    follows = [
        recording.with_wider_tolerances(it)
        for recording, it in zip(recordings, fitted.expansions, strict=True)
    ]
    if any(
        getattr(wide.tolerances, what) > WORTH_WIDENING * getattr(recording.tolerances, what)
        for recording, wide in zip(recordings, follows, strict=True)
        for what in ("force", "recoil")
    ):
        recordings, first = follows, fitted
        fitted = fit(recordings, coordinates, first.phi, **options)
        fitted = replace(fitted, steps=first.steps + fitted.steps)
    for expansion in fitted.expansions:
        if not len(expansion.form.residuals.picture):
            print(
                f"note: {expansion.form.residuals.episode.band}: its pictures show fewer than"
                f" {LEAST_POINTS} points in each of {BINS} parts of the band, so its force alone is"
                " fitted",
                file=sys.stderr,
            )
    birge = birge_ratio(fitted, coordinates)
    evidence_left = Remaining(fitted, coordinates, recordings, launches, workers or cores())
    samples, effective, batches = samples_of(evidence_left, birge, params.optimizer.seed)
    mode = coordinates.parameters(fitted.phi[None]).sample()
    return Identified(
        coordinates,
        fitted,
        birge,
        samples,
        effective,
        batches,
        recordings,
        launches,
        at_edges(params, method, {name: mode[name] for name in parameter_names(coordinates.law)}),
    )


def recorded_history(sling: ClampedBand, episodes: Sequence[Episode]) -> LaunchHistory | None:
    """What a band remembers that is launched as it was first recorded, after all recordings.

    None for a law without memory.
    """
    if sling.law != RUBBER:
        return None
    pull_history = launch_history(episodes[0])
    return LaunchHistory(pull_history["pull_time"], pull_history["pause"], deepest_draw(episodes))


def birge_ratio(fitted: Fit, coordinates: Coordinates) -> float:
    """Birge's ratio of N recordings, at least 1: how far each alone would go from the mode.

    Of each, the drop of its misfit to its own least is chi squared of D' D (N - 1)/N coordinates
    that it tells, D' those which it knows better than the rest together. A coordinate that is held
    at a bound does not count: recordings that all would have it beyond do not differ in that.
    """
    if len(fitted.expansions) < 2:
        return 1.0
    free = np.flatnonzero(~held(fitted, coordinates))
    every, total, freedom = fitted.hessian[np.ix_(free, free)], 0.0, 0.0
    for expansion in fitted.expansions:
        own, gradient = expansion.hessian[np.ix_(free, free)], expansion.gradient[free]
        inverse = np.linalg.inv(own + every)  # regular where the recording alone shows nothing
        share = np.linalg.solve(every, own)
        total += gradient @ inverse @ gradient
        freedom += np.trace(inverse @ own @ (np.eye(len(share)) - share))
    return float(np.sqrt(max(total / max(freedom, 1e-9), 1.0)))
