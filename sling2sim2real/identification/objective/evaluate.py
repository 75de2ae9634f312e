"""Losses of a batch of parameters: simulate, compare, and say what failed."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.loss import TERMS, EpisodeLoss
from sling2sim2real.simulator.interaction import Rollouts, interact, with_recorded_pads
from sling2sim2real.simulator.model import ClampedBand

SLICE = {"cpu": 16, "cuda": 16384}  # rollouts a call: the lanes of a CPU vector; what memory holds

Simulate = Callable[..., Rollouts]
simulated: Simulate = partial(interact, fetch=False)  # the loss is computed where the rollouts are


@dataclass(frozen=True)
class Evaluation:
    """N evaluated points of a box with D axes.

    Attributes:
        unit, theta: In the unit cube, and physical values of the box's axes, shape (N, D).
        terms: Each loss term, shape (N,); NaN where the rollout failed.
        total: Weighted sum of the terms, shape (N,); +inf where the rollout failed.
        failure: None or the reason, length N.
    """

    unit: np.ndarray
    theta: np.ndarray
    terms: dict[str, np.ndarray]
    total: np.ndarray
    failure: list[str | None]


class Evaluator:
    """Evaluates points of the unit cube against one episode.

    Results ignore the number of workers, and of GPUs of one kind: a rollout knows none of the
    others in its batch.
    """

    def __init__(
        self,
        episode: Episode,
        band: ClampedBand,
        loss: EpisodeLoss,
        box: SearchBox,
        *,
        devices: Sequence[str] = ("cpu",),
        workers: int | None = None,
        simulate: Simulate = simulated,
        whole: bool = False,
    ) -> None:
        """Keep what every batch needs.

        Args:
            band: Its pads open as the recording shows, where that says it.
            devices: Of one kind; they share each batch evenly, in their order.
            workers: Threads on the CPU (the kernels release the interpreter); None: all cores.
            simulate: Called as `simulate(band, episode=, parameters=, device=)`.
            whole: One call a batch, on the first device.
        """
        self.box, self.loss = box, loss
        self._band = with_recorded_pads(band, episode)
        self._simulate = partial(simulate, episode=episode)
        on_gpu = devices[0].startswith("cuda")
        self._slice = sys.maxsize if whole else SLICE["cuda" if on_gpu else "cpu"]
        threads = 1 if on_gpu else workers or os.cpu_count()
        self._devices = devices[:1] if whole else devices
        self._pools = [ThreadPoolExecutor(threads) for _ in self._devices]

    def __call__(self, unit: np.ndarray) -> Evaluation:
        """Evaluate points of the unit cube, shape (N, D)."""
        unit = np.array(unit, float)
        theta = self.box.to_physical(unit)
        shares = np.array_split(theta, len(self._devices))
        begun = [  # on all of them, before any result is waited for
            pool.map(partial(self._evaluate, device), self._slices(share))
            for device, pool, share in zip(self._devices, self._pools, shares, strict=True)
        ]
        parts = [part for each in begun for part in each]
        terms = {name: np.concatenate([part[0][name] for part in parts]) for name in TERMS}
        failure = [reason for part in parts for reason in part[1]]
        with np.errstate(invalid="ignore", over="ignore"):  # failed rollouts may hold anything
            total = self.loss.total(terms)
        failure = [
            reason or (None if finite else "the loss is not finite")
            for reason, finite in zip(failure, np.isfinite(total), strict=True)
        ]
        failed = np.array([reason is not None for reason in failure])
        terms = {name: np.where(failed, np.nan, values) for name, values in terms.items()}
        total = np.where(failed, np.inf, total)
        return Evaluation(unit, theta, terms, total, failure)

    def _slices(self, theta: np.ndarray) -> Iterator[np.ndarray]:
        return (theta[i : i + self._slice] for i in range(0, len(theta), self._slice))

    def _evaluate(
        self, device: str, theta: np.ndarray
    ) -> tuple[dict[str, np.ndarray], list[str | None]]:
        parameters = self.box.parameters(theta)
        rollouts = self._simulate(self._band, parameters=parameters, device=device)
        with np.errstate(invalid="ignore", over="ignore"):  # failed rollouts may hold anything
            return self.loss.terms(rollouts), rollouts.failure


class Penalty:
    """The losses that an optimiser gets: a failed point has twice the worst finite loss so far."""

    def __init__(self) -> None:
        self.worst = 0.0

    def __call__(self, total: np.ndarray) -> np.ndarray:
        finite = np.isfinite(total)
        self.worst = max([self.worst, *total[finite]])
        return np.where(finite, total, 2 * self.worst if self.worst else 1e6)
