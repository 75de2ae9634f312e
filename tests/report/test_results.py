"""Which evaluation is the best so far, and the paper's loss of it."""

import numpy as np
import pandas as pd
from hypothesis import given
from hypothesis import strategies as st

from pipeline.report.results import PRINTED, best_so_far, has_another_loss, printed


def rows(total, geom, force=0.0, work=0.0) -> pd.DataFrame:
    columns = np.broadcast_arrays(total, geom, force, work)
    return pd.DataFrame(dict(zip(("total", *PRINTED), columns, strict=True)))


def test_the_best_by_another_loss_may_print_worse() -> None:
    history = rows([np.inf, 3, 5, 2, 2, 1], [np.nan, 1, 0.5, 4, 9, 2], force=0.5, work=0.25)
    best = best_so_far(history)
    assert best.tolist() == [0, 1, 1, 3, 3, 5]  # among equals the first
    np.testing.assert_allclose(printed(history)[best], [np.inf, 1.75, 1.75, 4.75, 4.75, 2.75])


@given(st.lists(st.floats(0, 9) | st.just(np.inf), min_size=1, max_size=40))
def test_the_methods_own_best_never_rises(total: list[float]) -> None:
    best = np.array(total)[best_so_far(rows(total, 0.0))]
    np.testing.assert_array_equal(best, np.minimum.accumulate(total))


def test_which_weights_are_the_printed_ones() -> None:
    ones = {"geom": 1, "force": 1, "work": 1}
    assert not has_another_loss(ones)
    for another in ({"work": 0}, {"geom": 2}):
        assert has_another_loss(ones | another)
