"""A method of params.yaml by library calls: what it finds in episodes, and in its own law's.

It sees episodes alone; nothing here knows the rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.base.machine import cores
from pipeline.episode.episode import Episode
from pipeline.episode.signal import cutoff_hz
from pipeline.identify.identify import identify
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.evaluate import Evaluator
from pipeline.identify.objective.loss import TERMS, EpisodeLoss
from pipeline.identify.posterior import identify as posterior
from pipeline.identify.posterior.launches import Evidence, Observed
from pipeline.launching.trials.spread import landing_intervals
from pipeline.params.identification import parameter_names
from pipeline.simulator.launch import Launches, launch
from pipeline.simulator.model import ClampedBand, LaunchSetup
from pipeline.simulator.parameters import Parameters
from validation.synthetic import disturbed, own_law_episode, pull_and_release

WORKERS = cores()
FLAWS = {
    "release": 3e-4,
    "camera": 5e-4,
    "shift": 1e-3,
    "turn": 1e-3,
    "bias": 0.01,
}  # of a recorder


class Calibrated:
    """A method's θ of a band, and its simulator.

    Attributes:
        sling, setup: As it is launched.
        theta, samples: One sample, and those of what is known of it, or None.
    """

    def __init__(
        self,
        sling: ClampedBand,
        setup: LaunchSetup,
        theta: Parameters,
        samples: Parameters | None = None,
    ) -> None:
        self.sling, self.setup, self.theta, self.samples = sling, setup, theta, samples

    @property
    def identified(self) -> dict[str, float]:
        """What the method has looked for, by name: without samples no more than its box has."""
        names = parameter_names(self.theta.law) if self.samples is None else self.theta.names
        return {name: self.theta.sample()[name] for name in names}

    def __call__(self, draws: np.ndarray, parameters: Parameters | None = None) -> Launches:
        """Launches of draws (N, 2) with θ, or with N parameters."""
        return launch(self.sling, self.setup, parameters or self.theta, draws, workers=WORKERS)


def found(
    params,
    method: str,
    sling: ClampedBand,
    episodes: Sequence[Episode],
    observed: Sequence[Observed] = (),
    devices: Sequence[str] = ("cpu",),
) -> tuple[Calibrated, dict]:
    """What a method finds, and says of it: least squares takes all, others the first.

    Searches have their rollouts on `devices`, the fit of least squares on the CPU.
    Of another search than least squares it says "loss": the terms and the total of the best.
    """
    box = SearchBox.of_method(params, method)
    loss = EpisodeLoss.of(params, method, episodes[0], sling)
    evaluate = Evaluator(episodes[0], sling, loss, box, workers=WORKERS, devices=devices)
    history = posterior.recorded_history(sling, episodes)
    setup = LaunchSetup.of(params.setup, params.sling, history)
    evidence = Evidence(observed, setup)
    identified = identify(
        params, method, sling, episodes, evaluate, evidence=evidence, workers=WORKERS
    )
    density = identified.density
    if density is None:
        best = identified.evaluations.best()
        told = {"loss": {name: best[name] for name in (*TERMS, "total")}}
        return Calibrated(sling, setup, identified.theta), told
    told = posterior.confidence(density, params.parameters)
    return Calibrated(sling, setup, density.mode, density.parameters), told


def own_law(params, method: str, number: int) -> dict:
    """An episode of the simulator's own law, drawn from the priors: what the method makes of it.

    Noise, clocks and extrinsics are off as a recorder's are. Even numbers neither relax nor have a
    Mooney share. The exploration has a fifth of the budget's rollouts.

    Returns:
        "E", "loss_factor": relative errors of θ*; "landing" of a launch, "low" and "high" of its
        90 % interval [m]; "covers": which parameters' intervals hold the truth; "recoil" [s].
    """
    rng = np.random.default_rng([19, number])
    band = next(iter(params.bands))
    about = params.methods[method]
    sling = ClampedBand.of(params.bands[band], params.setup, params.sling, law=about.law)
    coordinates = posterior.Coordinates.of_method(params, method, sling)
    true = coordinates.expected.copy()

    def at(name: str, value: float) -> None:
        true[coordinates.names.index(name)] = value

    def spread(name: str) -> float:
        return coordinates.precision[coordinates.names.index(name)] ** -0.5

    true[0] = rng.uniform(*np.log([1.5e5, 4.5e5]))
    true[1] += rng.normal(0, coordinates.precision[1] ** -0.5)
    if number % 2:
        at("mooney_share", rng.uniform(0.0, 0.6))
        at("relaxation", rng.uniform(0.0, 0.06))
    at("air_drag", abs(rng.normal(0, spread("air_drag"))))
    at("turn_damping", rng.uniform() if number % 4 > 1 else 0.0)
    at("log_returned_share", rng.normal(0, spread("log_returned_share")))
    truth = coordinates.parameters(true[None])
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    plan = pull_and_release(band, params.episode, sling)
    plan = replace(plan, cloud_time=plan.cloud_time + rng.uniform(0, 1 / 30))
    exact = own_law_episode(sling, plan, truth, cutoff=cutoff, seed=number)
    episode = disturbed(exact, rng, **FLAWS)
    small = params.optimizer.model_copy(update={"population": 12, "generations": 2, "k_nn": 6})
    params = params.model_copy(update={"optimizer": small})
    outcome, told = found(params, method, sling, [episode])
    draw = np.array([[rng.uniform(-0.36, -0.30), rng.uniform(-0.18, -0.12)]])
    off = rng.normal(0, params.trials.actuation_error, 2)
    landed = outcome(draw + off, truth)
    low, high = landing_intervals(outcome, draw, outcome.samples, params.trials.actuation_error)[0]
    found_at = coordinates.of(outcome.theta)
    return {
        "E": float(np.expm1(found_at[0] - true[0])),
        "loss_factor": float(np.expm1(found_at[1] - true[1])),
        "landing": float(landed.landing_y[0]),
        "low": float(low),
        "high": float(high),
        "covers": {
            name: bool(told["parameters"][name]["low"] <= value <= told["parameters"][name]["high"])
            for name, value in truth.sample().items()
            if name in parameter_names(about.law) and name not in about.fixed
        },
        "recoil": told["recordings"][0]["pictures"],
        "settled": told["settled"],
    }
