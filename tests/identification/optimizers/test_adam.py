"""Adam by forward differences: closed gradients, torch's own steps, walls of failures."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.identification.optimizers.adam.adam import Adam
from tests.identification.search.functions import CENTRE, alone, changed, correlated, quadratic

D = 5
MATRIX = correlated()


value = quadratic(CENTRE, MATRIX).function


def begun(population: int = 6, **settings) -> Adam:
    """An optimiser that has the losses of its first batch."""
    optimizer = Adam(D, rollouts=600, seed=1, population=population, **settings)
    optimizer.tell(value(optimizer.ask()))
    return optimizer


@given(place=st.lists(st.floats(0, 1), min_size=D, max_size=D), step=st.floats(1e-4, 0.02))
def test_its_gradient_is_the_functions(place: list[float], step: float) -> None:
    """To the error of a forward difference, step times half the curvature, at the faces too."""
    optimizer = begun(step=step)
    optimizer._x[0].data.copy_(torch.tensor(place, dtype=torch.float64))
    requested = optimizer.ask()
    assert requested.min() >= 0
    assert requested.max() <= 1
    np.testing.assert_array_equal(requested[0], place)
    np.testing.assert_allclose(np.abs(requested[1:] - requested[0]), step * np.eye(D), atol=1e-12)
    optimizer._steepest = optimizer._worst = np.inf
    optimizer.tell(value(requested))
    exact = 2 * MATRIX @ (np.array(place) - CENTRE)
    gradient = optimizer._x[0].grad
    bound = step * np.diag(MATRIX) * (1 + 1e-6) + 1e-9
    assert (np.abs(gradient.numpy() - exact) <= bound).all()


def test_its_steps_are_torchs() -> None:
    """On a linear loss, whose differences are exact, with the rate that falls along a cosine."""
    slope = np.array([3.0, -1.0, 0.5, 2.0, -0.1])
    optimizer = Adam(D, rollouts=6 + 6 * 20, seed=1, population=6, rate=0.02)
    first = optimizer.ask()
    optimizer.tell(first @ slope)
    x = torch.tensor(first[np.argmin(first @ slope)], requires_grad=True)
    adam = torch.optim.Adam([x], lr=0.02)
    for number in range(20):
        requested = optimizer.ask()
        np.testing.assert_allclose(requested[0], x.detach().numpy(), atol=1e-9)
        optimizer.tell(requested @ slope)
        adam.param_groups[0]["lr"] = 0.02 * (1 + np.cos(np.pi * (number + 1) / 20)) / 2
        x.grad = torch.from_numpy(slope)
        adam.step()
        x.data.clamp_(0, 1)


def test_it_starts_from_the_best_of_the_latin_hypercube() -> None:
    optimizer = Adam(D, rollouts=600, seed=1, population=20)
    first = optimizer.ask()
    optimizer.tell(value(first))
    assert optimizer.ask().shape == (3 * (D + 1), D)  # as many starts as a batch has room for
    best = first[np.argsort(value(first))[:3]]
    np.testing.assert_array_equal(optimizer.ask()[:: D + 1], best)
    np.testing.assert_array_equal(optimizer.owner, np.repeat(range(3), D + 1))


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
    optimizer = begun()
    good = optimizer.ask()[0].copy()
    optimizer.tell(value(optimizer.ask()))
    first = np.abs(optimizer.ask()[0] - good).max()
    optimizer.tell(np.full(D + 1, 1e6))
    np.testing.assert_array_equal(optimizer.ask()[0], good)
    optimizer.tell(value(optimizer.ask()))
    assert 0 < np.abs(optimizer.ask()[0] - good).max() < 0.6 * first
