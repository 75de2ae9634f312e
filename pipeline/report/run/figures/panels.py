"""A panel a band, with a common title that says what to see."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import fill

import matplotlib.pyplot as plt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.report.drawing.canvas import key

COLUMNS = 3
ENTRY = 2.6  # inches of an entry of a key
LETTERS = 11.5  # of a title, an inch


def panels(
    bands: Iterable[str], title: str, wide: float, tall: float, **more
) -> tuple[Figure, dict[str, Axes]]:
    """A figure with a panel a band, three in a row.

    Args:
        wide, tall: Of a panel [inches].
        more: For matplotlib's `subplots`.

    Returns:
        The figure, and its axes by band.
    """
    bands = list(bands)
    columns = min(len(bands), COLUMNS)
    rows = -(-len(bands) // columns)
    size = max(columns * wide, 5.6), rows * tall + 0.9
    figure, axes = plt.subplots(rows, columns, figsize=size, squeeze=False, **more)
    for ax in axes.flat[len(bands) :]:
        ax.remove()
    found = dict(zip(bands, axes.flat, strict=False))
    for band, ax in found.items():
        ax.set_title(band, fontsize=9)
    entitle(figure, title)
    return figure, found


def explain(figure: Figure, entries: Iterable[tuple[str, Artist]]) -> None:
    """What is what, below the picture, in as many columns as it has room for."""
    entries = list(entries)
    key(figure, entries, min(len(entries), max(int(figure.get_figwidth() / ENTRY), 1)))


def entitle(figure: Figure, title: str) -> None:
    """What to see, above the picture."""
    lines = fill(title, int(LETTERS * figure.get_figwidth()))
    figure.suptitle(lines, x=0.01, ha="left", fontsize=10, fontweight="bold")
