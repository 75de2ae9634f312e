"""What all pictures share. Equal data give equal bytes.

Black is what was measured; a method has one colour everywhere (sling2sim2real/drawing/styles.py).
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec

import matplotlib.pyplot as plt
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.style import context
from matplotlib.ticker import MaxNLocator, NullFormatter, NullLocator
from PIL import Image

from sling2sim2real.base.files import replacing
from sling2sim2real.drawing.styles import THEME

WEBP_QUALITY = 88
P = ParamSpec("P")
Saving = Callable[Concatenate[Path, P], None]  # what draws a picture, and writes it at a path


def mark(**style) -> Line2D:
    """A line or a dot for a key."""
    return Line2D([], [], **style)


def patch(color: str, **style) -> Rectangle:
    """A filled square for a key."""
    return Rectangle((0, 0), 1, 1, color=color, **style)


def key(figure: Figure, entries: Iterable[tuple[str, Artist]], columns: int = 0, **more):
    """What is what, below the picture or where `more` says, in one line or in so many columns."""
    names, marks = zip(*entries, strict=True)
    more = {"loc": "outside lower center", "ncols": columns or len(names)} | more
    figure.legend(marks, names, **more)


def few_ticks(axis) -> None:
    """Round numbers on a logarithmic axis, though it may be shorter than a decade."""
    low, high = sorted(axis.get_view_interval())
    axis.set_major_formatter("{x:g}")
    if high < 10 * low:
        axis.set_major_locator(MaxNLocator(4))
        axis.set_minor_locator(NullLocator())
    else:
        axis.set_minor_formatter(NullFormatter())


def picture(
    theme: dict[str, Any] | None = None, dpi: int = 130
) -> Callable[[Callable[P, Figure]], Saving[P]]:
    """Have a function that makes a figure draw it in the theme and save it at a path, given first.

    Args:
        theme: Settings of matplotlib's besides THEME.
    """

    def saving(draw: Callable[P, Figure]) -> Saving[P]:
        @wraps(draw)
        def drawn(path: Path, *arguments: P.args, **named: P.kwargs) -> None:
            with context([THEME, theme or {}]):
                save(draw(*arguments, **named), path, dpi)

        return drawn

    return saving


def save(figure: Figure, path: Path, dpi: int) -> None:
    """Write the picture and forget it: as PNG of 256 colours, a third of the size, or as WebP."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=dpi)
    plt.close(figure)
    image, quality = Image.open(drawn).convert("RGB"), {}
    if path.suffix == ".png":
        image = image.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    else:  # a camera's picture has more colours
        quality = {"quality": WEBP_QUALITY}
    with replacing(path) as temporary:
        image.save(temporary, path.suffix[1:], **quality)
