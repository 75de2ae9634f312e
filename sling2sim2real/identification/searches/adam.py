"""Adam on gradients by forward differences, from the best points of a Latin hypercube."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sling2sim2real.identification.objective.box import latin_hypercube

if TYPE_CHECKING:
    from sling2sim2real.identification.search import Evaluate

# Of an edge: no derivative counts for more than the first batch's median rise over it.
STEEPEST_RISE_EDGE = 0.1


def adam(
    evaluate: Evaluate,
    dimension: int,
    *,
    rollouts: int,
    seed: int,
    population: int,
    rate: float = 0.05,
    step: float = 0.003,
) -> None:
    """Several starts side by side, as many as a batch of `population` points has room for.

    Each is a point x and its D differences, x + step e_i, or x - step e_i where that would leave
    the cube: D + 1 points. Then x moves by torch.optim.Adam and is clamped to the cube. The rate
    falls to zero along half a cosine over the budget.

    A failed difference point gets a huge loss. Its derivative is cut, else it would stay in
    Adam's running mean of squares and stop that axis for a thousand steps. A start whose own point
    is no better than the worst of the first batch has failed, or might as well: it goes back to its
    best point, forgets its momentum and halves its rate.

    Args:
        rate: The first learning rate: what a coordinate moves in a step, in edges of the cube.
        step: Of the differences, in edges of the cube.

    Raises:
        ValueError: One is not above 0, or the step is more than half an edge.
    """
    if not (rate > 0 and 0 < step <= 0.5):
        raise ValueError(f"rate and step must be above 0, step at most 0.5: {rate}, {step}")
    starts = min(max(population // (dimension + 1), 1), population)
    steps = max((rollouts - population) // (starts * (dimension + 1)), 1)
    points = latin_hypercube(dimension, population, seed)
    losses = evaluate(points)

    import torch

    order = np.argsort(losses, kind="stable")[:starts]
    at = [torch.tensor(points[row], requires_grad=True) for row in order]
    best = [(losses[row], x.detach().clone()) for row, x in zip(order, at, strict=True)]
    worst, steepest = losses.max(), (np.median(losses) - losses.min()) / STEEPEST_RISE_EDGE
    optimizer = torch.optim.Adam([{"params": [x], "share": 1.0} for x in at], lr=rate)
    solver, done = np.repeat(np.arange(starts), dimension + 1), 0
    while True:
        x = np.stack([x.detach().numpy() for x in at])
        moved = np.where(x + step <= 1, step, -step)  # (starts, D)
        points = np.tile(x[:, None], (1, dimension + 1, 1))
        points[:, 1:] += moved[:, None] * np.eye(dimension)
        losses = evaluate(points.reshape(-1, dimension), solver).reshape(starts, -1)
        gradient = np.clip((losses[:, 1:] - losses[:, :1]) / moved, -steepest, steepest)
        done += 1
        fallen = (1 + math.cos(math.pi * min(done / steps, 1))) / 2
        for start, (x, group) in enumerate(zip(at, optimizer.param_groups, strict=True)):
            loss = losses[start, 0]
            x.grad = torch.from_numpy(gradient[start].copy())
            if loss >= worst:
                x.data.copy_(best[start][1])
                x.grad = None  # is left where it is this time
                optimizer.state.pop(x, None)
                group["share"] /= 2
            elif loss < best[start][0]:
                best[start] = loss, x.detach().clone()
            group["lr"] = rate * group["share"] * fallen
        optimizer.step()
        for x in at:
            x.data.clamp_(0, 1)
