"""An optimiser and a loss of your own, on a recorded episode.

    python examples/own_optimizer.py

The optimiser is asked for points of the unit cube and gets their losses. The class has the form
that params.yaml takes too: `search: my_module:Narrowing` under `methods` runs it in the pipeline.
"""

import numpy as np

import sling2sim2real as s2s

BAND = s2s.Band(mass=0.023, diameter=0.010, rest_length=0.52)  # kg, m, m
TRUE = s2s.Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6)


class Narrowing:
    """Gaussians around the best point so far, which narrow from batch to batch."""

    phase = "narrowing"

    def __init__(self, dimension: int, *, rollouts: int, seed: int, population: int) -> None:
        self.rng, self.population = np.random.default_rng(seed), population
        self.best, self.least, self.width = np.full(dimension, 0.5), np.inf, 0.3
        self.shrink = 0.03 ** (population / rollouts)  # to 0.03 of the width at the end

    def ask(self) -> np.ndarray:
        size = (self.population, len(self.best))
        self.requested = np.clip(self.best + self.width * self.rng.normal(size=size), 0, 1)
        return self.requested  # (N, D)

    def tell(self, losses: np.ndarray) -> None:
        if losses.min() < self.least:
            self.best, self.least = self.requested[losses.argmin()], losses.min()
        self.width *= self.shrink


def force_alone(simulated: s2s.Simulation, episode: s2s.Episode) -> float:
    """A loss of your own: mean distance of the forces [N]."""
    return float(np.linalg.norm(episode.force - simulated.force, axis=1).mean())


def main() -> None:
    model = s2s.Model(BAND, TRUE, settings=s2s.Settings.coarse())
    episode = s2s.episode_from_arrays(**s2s.rehearse(model))  # or s2s.read_mcap("my.mcap", BAND)
    for name, loss in (("the paper's loss", None), ("force alone", force_alone)):
        objective = s2s.Objective(model, [episode], method="paper", loss=loss)
        optimizer = Narrowing(len(objective.names), rollouts=320, seed=1, population=16)
        for _ in range(20):
            optimizer.tell(objective(optimizer.ask()))
        print(f"{name}: {optimizer.least:.3f} after 320 rollouts")
        for axis in objective.names:
            value = getattr(objective.theta(optimizer.best), axis)
            print(f"  {axis:20} {value:10.4g}  truth {getattr(TRUE, axis):.4g}")


if __name__ == "__main__":
    main()
