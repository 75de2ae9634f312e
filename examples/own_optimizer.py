"""A search and a loss of your own, on a recorded episode.

    python examples/own_optimizer.py

The search calls a function with points of the unit cube and gets their losses. It has the form that
params.yaml takes too: `search: my_module:narrowing` under `methods` runs it in the pipeline.
"""

import numpy as np

import sling2sim2real as s2s

BAND = s2s.Band(mass=0.023, diameter=0.010, rest_length=0.52)  # kg, m, m
TRUE = s2s.Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6, law="corotated")  # the law of `paper`


def narrowing(evaluate, dimension: int, *, rollouts: int, seed: int, population: int) -> None:
    """Gaussians around the best point so far, which narrow from batch to batch."""
    rng, best, least, width = np.random.default_rng(seed), np.full(dimension, 0.5), np.inf, 0.3
    for _ in range(rollouts // population):
        points = np.clip(best + width * rng.normal(size=(population, dimension)), 0, 1)  # (N, D)
        losses = evaluate(points)
        if losses.min() < least:
            best, least = points[losses.argmin()], losses.min()
        width *= 0.03 ** (population / rollouts)  # to 0.03 of the width at the end


def force_alone(simulated: s2s.Simulation, episode: s2s.Episode) -> float:
    """A loss of your own: mean distance of the forces [N]."""
    return float(np.linalg.norm(episode.force - simulated.force, axis=1).mean())


def main() -> None:
    model = s2s.Model(BAND, TRUE, settings=s2s.Settings.coarse())
    episode = s2s.episode_from_arrays(**s2s.rehearse(model))  # or s2s.read_mcap("my.mcap", BAND)
    for name, loss in (("the paper's loss", None), ("force alone", force_alone)):
        objective = s2s.Objective(model, [episode], method="paper", loss=loss)
        seen = []

        def evaluate(points, objective=objective, seen=seen):
            losses = objective(points)
            seen.extend(zip(losses, points, strict=True))
            return losses

        narrowing(evaluate, len(objective.names), rollouts=320, seed=1, population=16)
        least, best = min(seen, key=lambda pair: pair[0])
        print(f"{name}: {least:.3f} after {len(seen)} rollouts")
        for axis in objective.names:
            value = getattr(objective.theta(best), axis)
            print(f"  {axis:20} {value:10.4g}  truth {getattr(TRUE, axis):.4g}")


if __name__ == "__main__":
    main()
