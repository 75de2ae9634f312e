"""Names of files in pictures are drawn letter by letter."""

import matplotlib.pyplot as plt
import pytest

from pipeline.report.drawing.names import as_label
from tests.hostile import MARKUP

TEX = "$\\frac{a$.mcap"


@pytest.mark.filterwarnings("ignore:Glyph")
@pytest.mark.parametrize("name", MARKUP)
def test_any_name_can_be_drawn(name: str) -> None:
    figure = plt.figure()
    try:
        figure.suptitle(as_label(name), wrap=True)
        figure.gca().set_xticks([0.5], [as_label(name)])
        figure.canvas.draw()
    finally:
        plt.close(figure)


def test_tex_is_what_a_plain_name_would_be_read_as() -> None:
    figure = plt.figure()
    figure.suptitle(TEX)
    with pytest.raises(ValueError, match="frac"):
        figure.canvas.draw()
    plt.close(figure)
    short = plt.figure().text(0, 0, as_label("a$b$"))
    long = plt.figure().text(0, 0, "a$b")
    assert short.get_window_extent().width > long.get_window_extent().width
    plt.close("all")
