from __future__ import annotations

import matplotlib.pyplot as plt
import pytest

from pipeline.report.figures import confidence, episode, launches, loaded, policy


@pytest.fixture
def kept(monkeypatch) -> list[plt.Figure]:
    """Figures that were drawn, in place of their files."""
    figures: list[plt.Figure] = []
    for module in (confidence, episode, launches, loaded, policy):
        monkeypatch.setattr(module, "save", lambda figure, path: figures.append(figure))
    yield figures
    plt.close("all")
