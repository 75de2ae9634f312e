"""Landings beside predictions, read back from the objects that were drawn."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

from pipeline.report.figures import policy
from pipeline.report.looks import looks
from tests.report.conftest import METHOD, launches


@pytest.fixture
def kept(monkeypatch) -> list[plt.Figure]:
    figures: list[plt.Figure] = []
    monkeypatch.setattr(policy, "save", lambda figure, path: figures.append(figure))
    yield figures
    plt.close("all")


def test_every_method_has_a_row_and_two_have_intervals(kept) -> None:
    methods = [METHOD, "de", "bo"]
    trials = pd.concat([launches().assign(method=method) for method in methods])
    policy.landings("", trials, looks(methods), methods[:2])
    left, right = kept[0].axes
    bars = [line for line in left.lines if len(set(line.get_xdata())) == 1]
    assert len(bars) == 2 * 3  # the fourth did not land
    np.testing.assert_allclose(bars[0].get_ydata(), [1.7, 1.75])
    rows = {}
    for dots in right.collections:
        for error, row in dots.get_offsets():
            rows.setdefault(row, []).append(error)
    assert sorted(rows) == [0, 1, 2]
    expected = 100 * (np.array([1.725, 1.725, 1.925]) / [1.745, 1.695, 1.965] - 1)
    np.testing.assert_allclose(sorted(rows[2]), sorted(expected))
    assert [label.get_text() for label in right.get_yticklabels()][1:] == ["DE_L", "BO_L"]


def test_launches_without_intervals_are_drawn_too(kept) -> None:
    trials = launches().drop(columns=["predicted_low", "predicted_high"])
    policy.landings("", trials, looks([METHOD]), [METHOD])
    assert "90 % interval" not in [text.get_text() for text in kept[0].legends[0].get_texts()]
