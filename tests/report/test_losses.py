"""Convergence by hand: the printed loss of each method's own best."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.report.results import best_so_far, has_another_loss, printed


def rows(total, geom, force=0.0, work=0.0) -> pd.DataFrame:
    columns = np.broadcast_arrays(total, geom, force, work)
    return pd.DataFrame(dict(zip(("total", "geom", "force", "work"), columns, strict=True)))


def test_the_best_by_another_loss_may_print_worse() -> None:
    history = rows([np.inf, 3, 5, 2, 2, 1], [np.nan, 1, 0.5, 4, 9, 2], force=0.5, work=0.25)
    best = best_so_far(history)
    assert best.tolist() == [0, 1, 1, 3, 3, 5]  # among equals the first
    np.testing.assert_allclose(printed(history)[best], [np.inf, 1.75, 1.75, 4.75, 4.75, 2.75])


@given(st.lists(st.floats(0, 9) | st.just(np.inf), min_size=1, max_size=40))
def test_the_methods_own_best_never_rises(total: list[float]) -> None:
    best = np.array(total)[best_so_far(rows(total, 0.0))]
    np.testing.assert_array_equal(best, np.minimum.accumulate(total))


@pytest.mark.parametrize(
    ("weights", "another"),
    [
        ({"geom": 1, "force": 1, "work": 1, "taut": 0}, False),
        ({"geom": 1, "force": 1, "work": 1, "taut": 0.5}, True),
        ({"geom": 1, "force": 1, "work": 0, "taut": 0}, True),
        ({"geom": 2, "force": 1, "work": 1, "taut": 0}, True),
    ],
)
def test_which_weights_are_the_printed_ones(weights: dict, another: bool) -> None:
    assert has_another_loss(weights) is another
