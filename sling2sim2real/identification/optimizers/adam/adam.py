"""Adam on gradients by forward differences, from the best points of a Latin hypercube."""

from __future__ import annotations

import math

import numpy as np

from sling2sim2real.identification.search.loop import latin_hypercube

RISE = 0.1  # of an edge: no derivative counts for more than the first batch's median rise over it


class Adam:
    """Several starts side by side, as many as a batch of `population` points has room for.

    Each is a point x and its D differences, x + step e_i, or x - step e_i where that would leave
    the cube: D + 1 points. Then x moves by torch.optim.Adam and is clamped to the cube. The rate
    falls to zero along half a cosine over the budget.

    A failed difference point gets a huge loss. Its derivative is cut, else it would stay in
    Adam's running mean of squares and stop that axis for a thousand steps. A start whose own point
    is no better than the worst of the first batch has failed, or might as well: it goes back to its
    best point, forgets its momentum and halves its rate.
    """

    phase = "adam"

    def __init__(
        self,
        dimension: int,
        *,
        rollouts: int,
        seed: int,
        population: int,
        rate: float = 0.05,
        step: float = 0.003,
    ) -> None:
        """Take the settings.

        Args:
            rate: The first learning rate: what a coordinate moves in a step, in edges of the cube.
            step: Of the differences, in edges of the cube.

        Raises:
            ValueError: One is not above 0, or the step is more than half an edge.
        """
        if not (rate > 0 and 0 < step <= 0.5):
            raise ValueError(f"rate and step must be above 0, step at most 0.5: {rate}, {step}")
        starts = max(population // (dimension + 1), 1)
        self._step, self._rate = step, rate
        self._steps = max((rollouts - population) // (starts * (dimension + 1)), 1)
        self._done = 0
        self._starts = min(starts, population)
        self._adam = None
        self._asked = latin_hypercube(dimension, population, seed)
        self.owner: np.ndarray | None = None  # which start asked for each point, shape (N,)

    def ask(self) -> np.ndarray:
        """The Latin hypercube, then (starts * (D + 1), D): each start's point and differences."""
        if self._adam is None:
            return self._asked
        at = np.stack([x.detach().numpy() for x in self._x])
        starts, dimension = at.shape
        self._moved = np.where(at + self._step <= 1, self._step, -self._step)
        points = np.tile(at[:, None], (1, dimension + 1, 1))
        points[:, 1:] += self._moved[:, None] * np.eye(dimension)
        self._asked = points.reshape(-1, dimension)
        self.owner = np.repeat(np.arange(starts), dimension + 1)
        return self._asked

    def tell(self, losses: np.ndarray) -> None:
        """Finite losses of the points that were asked for last, shape (N,)."""
        if self._adam is None:
            self._begin(losses)
            return
        import torch

        losses = losses.reshape(len(self._x), -1)
        gradient = (losses[:, 1:] - losses[:, :1]) / self._moved
        gradient = np.clip(gradient, -self._steepest, self._steepest)
        self._done += 1
        fallen = (1 + math.cos(math.pi * min(self._done / self._steps, 1))) / 2
        for start, (x, group) in enumerate(zip(self._x, self._adam.param_groups, strict=True)):
            loss = losses[start, 0]
            x.grad = torch.from_numpy(gradient[start].copy())
            if loss >= self._worst:
                x.data.copy_(self._best[start][1])
                x.grad = None  # is left where it is this time
                self._adam.state.pop(x, None)
                group["share"] /= 2
            elif loss < self._best[start][0]:
                self._best[start] = loss, x.detach().clone()
            group["lr"] = self._rate * group["share"] * fallen
        self._adam.step()
        for x in self._x:
            x.data.clamp_(0, 1)

    def _begin(self, losses: np.ndarray) -> None:
        """Start from the best points of the first batch."""
        import torch

        order = np.argsort(losses, kind="stable")[: self._starts]
        self._x = [torch.tensor(self._asked[row], requires_grad=True) for row in order]
        self._best = [
            (losses[row], x.detach().clone()) for row, x in zip(order, self._x, strict=True)
        ]
        self._worst = losses.max()
        self._steepest = (np.median(losses) - losses.min()) / RISE
        groups = [{"params": [x], "share": 1.0} for x in self._x]
        self._adam = torch.optim.Adam(groups, lr=self._rate)
