import matplotlib.pyplot as plt
import pytest

from pipeline.report.drawing import canvas


@pytest.fixture
def retained(monkeypatch) -> list[plt.Figure]:
    """Figures that were drawn, in place of their files."""
    figures: list[plt.Figure] = []
    monkeypatch.setattr(canvas, "save", lambda figure, *_: figures.append(figure))
    yield figures
    plt.close("all")
