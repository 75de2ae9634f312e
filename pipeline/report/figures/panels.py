"""A panel a band, with a common title that says what to see.

Figures are as wide as a column of text, so that they can be read on a phone.
"""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import fill

import matplotlib.pyplot as plt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sling2sim2real.drawing.canvas import key

COLUMNS, WIDTH = 2, 5.6  # panels in a row; inches
ENTRY = 2.6  # inches of an entry of a key
LETTERS = 11.5  # of a title, an inch


def panels(
    names: Iterable[str], title: str, tall: float, columns: int = COLUMNS, **more
) -> tuple[Figure, dict[str, Axes]]:
    """A figure with a panel a name.

    Args:
        tall: Height of a panel [inches].
        columns: Panels in a row, at most.
        more: For matplotlib's `subplots`.
    """
    names = list(names)
    columns = min(len(names), columns)
    rows = -(-len(names) // columns)
    size = WIDTH, rows * tall + 0.9
    figure, axes = plt.subplots(rows, columns, figsize=size, squeeze=False, **more)
    for ax in axes.flat[len(names) :]:
        ax.remove()
    by_name = dict(zip(names, axes.flat, strict=False))
    for name, ax in by_name.items():
        ax.set_title(name, fontsize=9)
    for ax in axes.flat[len(names) - columns : len(names)]:  # the lowest of each column
        ax.tick_params(labelbottom=True)
    entitle(figure, title)
    return figure, by_name


def explain(figure: Figure, entries: Iterable[tuple[str, Artist]]) -> None:
    """What is what, below the picture, in as many columns as it has room for."""
    entries = list(entries)
    key(figure, entries, min(len(entries), max(int(figure.get_figwidth() / ENTRY), 1)))


def entitle(figure: Figure, title: str) -> None:
    """What to see, above the picture."""
    lines = fill(title, int(LETTERS * figure.get_figwidth()))
    figure.suptitle(lines, x=0.01, ha="left", fontsize=10, fontweight="bold")
