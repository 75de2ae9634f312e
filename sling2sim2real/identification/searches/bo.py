"""Bayesian optimisation with BoTorch: batches of greatest expected improvement.

One thread and no global random numbers: the same seed asks for the same points, whatever the
number of cores. Another kind of CPU may round torch's products otherwise, and after some rounds
ask for other points.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import qmc

from sling2sim2real.base.machine import one_thread
from sling2sim2real.identification.objective.box import latin_hypercube, reflect

if TYPE_CHECKING:
    from botorch.models import SingleTaskGP

    from sling2sim2real.identification.search import Evaluate

FIT_STEPS = 10  # of L-BFGS on the hyperparameters, which start where the last round's ended
CANDIDATES = 512  # from which a batch is put together, half of them near the best points
BEST_POINTS = 10  # how many best points
POSTERIOR_SAMPLES = 128  # of the posterior, quasi-random
POLISH_STEPS = 20  # of L-BFGS on the whole batch


def bayesian(
    evaluate: Evaluate,
    dimension: int,
    *,
    rollouts: int,
    seed: int,
    population: int,
    points: int = 400,
    batch: int | None = None,
) -> None:
    """Latin hypercube, then batches of points chosen by qLogExpectedImprovement.

    The model is a SingleTaskGP with BoTorch's priors (Hvarfner et al. 2024) and an exponential
    kernel (Matern 1/2), a length scale an axis: losses are means of norms, whose valley is a kink,
    and smoother kernels foresee minima where there are none. Losses that lie further above the
    median than the least lies below it count as that far, because a few huge ones (a stiff band, a
    failure) would hide the rest; then they are standardised.

    A batch is put together greedily from candidates all over the cube and near the best points,
    each next one by what it adds to the expected improvement of those before, and then moves as a
    whole up the gradient of the acquisition function.

    Args:
        points: Of more evaluations the process sees the best half of that many and, of the others,
            the latest: exact inference costs their number cubed.
        batch: Points of a round; None: `population`, as many as the hypercube has.

    Raises:
        ValueError: `points` is no whole number above 1.
    """
    if not (isinstance(points, int) and points > 1):
        raise ValueError(f"points must be a whole number above 1, got {points}")
    unit = latin_hypercube(dimension, population, seed)
    losses, process, number = evaluate(unit), Process(), 0
    while True:
        number += 1
        rows = training_rows(losses, points)
        chosen = process.batch(
            unit[rows], -standardised(losses[rows]), batch or population, [seed, number]
        )
        unit, losses = np.concatenate([unit, chosen]), np.append(losses, evaluate(chosen))


class Process:
    """BoTorch's Gaussian process; each fit of its hyperparameters starts where the last ended."""

    def __init__(self) -> None:
        self._hyperparameters = None

    def batch(self, unit: np.ndarray, value: np.ndarray, count: int, seed: list[int]) -> np.ndarray:
        """The next `count` points, shape (count, D), by values (N,) at points (N, D)."""
        import torch
        from botorch.acquisition.logei import qLogExpectedImprovement
        from botorch.generation import gen_candidates_scipy
        from botorch.sampling.normal import SobolQMCNormalSampler

        with one_thread(), warnings.catch_warnings(record=True):  # BoTorch turns some on itself
            # It warns that an optimisation ends early, as ours mean to, and of close points.
            warnings.simplefilter("ignore")
            model, best = self._fitted(unit, value), value.max()
            candidates = _candidates(unit[np.argsort(-value, kind="stable")], seed)
            first, second = (
                SobolQMCNormalSampler(torch.Size([POSTERIOR_SAMPLES]), seed=int(number))
                for number in np.random.default_rng([*seed, 1]).integers(2**31, size=2)
            )
            with torch.no_grad():
                samples = first(model.posterior(torch.from_numpy(candidates)))[..., 0]
            start = candidates[greedy(samples.numpy(), best, count)]
            batch, _ = gen_candidates_scipy(
                torch.from_numpy(start)[None],
                qLogExpectedImprovement(model, best, second),
                lower_bounds=0.0,
                upper_bounds=1.0,
                options={"maxiter": POLISH_STEPS},
            )
        return batch[0].numpy().clip(0, 1)

    def _fitted(self, unit: np.ndarray, value: np.ndarray) -> SingleTaskGP:
        import torch
        from botorch.models import SingleTaskGP
        from botorch.models.utils.gpytorch_modules import get_covar_module_with_dim_scaled_prior
        from botorch.optim.fit import fit_gpytorch_mll_scipy
        from gpytorch.mlls import ExactMarginalLogLikelihood

        kernel = get_covar_module_with_dim_scaled_prior(unit.shape[1], use_rbf_kernel=False)
        kernel.nu = 0.5  # pyright: ignore[reportArgumentType]
        points, values = torch.from_numpy(unit), torch.from_numpy(value)[:, None]
        model = SingleTaskGP(points, values, covar_module=kernel, outcome_transform=None)
        if self._hyperparameters:
            model.load_state_dict(self._hyperparameters)
        likelihood = ExactMarginalLogLikelihood(model.likelihood, model)
        fit_gpytorch_mll_scipy(likelihood, options={"maxiter": FIT_STEPS})
        self._hyperparameters = model.state_dict()
        return model.eval()


def _candidates(best: np.ndarray, seed: list[int]) -> np.ndarray:
    """Half from a Sobol sequence, half near the first of `best`, at all scales."""
    rng = np.random.default_rng(seed)
    dimension, half = best.shape[1], CANDIDATES // 2
    everywhere = qmc.Sobol(dimension, rng=rng).random(half)
    scale = 10 ** rng.uniform(-2.3, -0.3, (half, 1))
    centre = best[rng.integers(min(BEST_POINTS, len(best)), size=half)]
    return np.concatenate([everywhere, reflect(centre + scale * rng.normal(size=centre.shape))])


def training_rows(loss: np.ndarray, points: int) -> np.ndarray:
    """All rows, or the best half of `points` and the latest of the others, in their order."""
    if len(loss) <= points:
        return np.arange(len(loss))
    best = np.argsort(loss, kind="stable")[: points // 2]
    others = np.setdiff1d(np.arange(len(loss)), best)
    return np.sort(np.concatenate([best, others[len(best) - points :]]))


def standardised(loss: np.ndarray) -> np.ndarray:
    """Losses cut at as far above their median as the least is below, mean 0, deviation 1."""
    rise = loss - loss.min()  # first, so that equal losses stay exactly equal
    cut = np.minimum(rise, 2 * np.median(rise))
    spread = cut.std(ddof=1)
    return (cut - cut.mean()) / (spread if spread > 0 else 1)


def greedy(samples: np.ndarray, best: float, count: int) -> list[int]:
    """`count` of C candidates, each the one that adds most to the batch's expected improvement.

    Args:
        samples: Of the candidates' values, jointly, shape (S, C).
        best: The value to improve on.
    """
    gain = np.maximum(samples - best, 0)  # over what those chosen reach, sample by sample
    chosen: list[int] = []
    for _ in range(count):
        total = gain.sum(axis=0)
        total[chosen] = -1
        chosen.append(int(total.argmax()))
        better = np.flatnonzero(gain[:, chosen[-1]])  # the others' gains stay what they are
        gain[better] = np.maximum(gain[better] - gain[better, chosen[-1:], None], 0)
    return chosen
