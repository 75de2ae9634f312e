"""Adam by forward differences: closed gradients, torch's own steps, walls of failures."""

import numpy as np
import torch

from sling2sim2real.identification.searches.adam import adam
from tests.identification.searches.functions import (
    CENTRE,
    alone,
    batches_of,
    changed,
    correlated,
    quadratic,
)

D = 5
MATRIX = correlated()
value = quadratic(CENTRE, MATRIX).function


def test_its_steps_are_torchs() -> None:
    """On a linear loss, whose differences are exact, with the rate that falls along a cosine."""
    slope = np.array([3.0, -1.0, 0.5, 2.0, -0.1])
    first, *others = batches_of(adam, lambda unit: unit @ slope, D, 126, population=6, rate=0.02)
    x = torch.tensor(first[np.argmin(first @ slope)], requires_grad=True)
    optimizer = torch.optim.Adam([x], lr=0.02)
    assert len(others) == 20
    for number, batch in enumerate(others):
        np.testing.assert_allclose(batch[0], x.detach().numpy(), atol=1e-9)
        optimizer.param_groups[0]["lr"] = 0.02 * (1 + np.cos(np.pi * (number + 1) / 20)) / 2
        x.grad = torch.from_numpy(slope)
        optimizer.step()
        x.data.clamp_(0, 1)


def test_it_starts_from_the_best_of_the_latin_hypercube() -> None:
    first, second, *_ = batches_of(adam, value, D, 600, population=20)
    assert second.shape == (3 * (D + 1), D)  # as many starts as a batch has room for
    np.testing.assert_array_equal(second[:: D + 1], first[np.argsort(value(first))[:3]])
    evaluations = alone("adam", quadratic(CENTRE, MATRIX), 38)
    assert evaluations.table["solver"].to_pylist()[24:] == [*[0] * 6, *[1] * 6, 2, 2]


def test_it_finds_a_minimum_beside_a_wall_of_failures() -> None:
    """The minimum lies 0.002 from the wall: less than a difference."""
    evaluate = quadratic(CENTRE, MATRIX, fails=lambda unit: unit[:, 3] > CENTRE[3] + 0.002)
    for seed in (1, 2, 3):
        evaluations = alone("adam", evaluate, 600, changed(seed=seed, population=20))
        assert np.isinf(evaluations.total[20:]).any() and np.isfinite(evaluations.unit).all()
        assert evaluations.total.min() - 1 < 0.1
        assert evaluations.total[:20].min() - 1 > 0.3


def test_a_start_that_fails_goes_back() -> None:
    """To its best point; the next step is shorter."""
    count = 0

    def once_bad(unit: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return np.full(len(unit), 1e6) if count == 3 else value(unit)

    _, good, bad, back, shorter, *_ = batches_of(adam, once_bad, D, 600, population=6)
    np.testing.assert_array_equal(back[0], good[0])
    first, second = (np.abs(batch[0] - good[0]).max() for batch in (bad, shorter))
    assert 0 < second < 0.6 * first
