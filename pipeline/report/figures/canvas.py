"""What all pictures share. Equal data give equal bytes.

Black is what was measured; a method has one colour everywhere (pipeline/report/styles.py).
"""

from __future__ import annotations

import io
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.ticker import LogFormatter
from PIL import Image

from pipeline.base.files import replacing

PARAMETERS = {  # name and unit on an axis, and the factor from SI to that unit
    "youngs_modulus": ("E [MPa]", 1e-6),
    "poissons_ratio": ("ν", 1.0),
    "elasticity_damping": ("d [ms]", 1e3),
    "dynamic_friction": ("friction", 1.0),
    "damping_scale": ("s", 1.0),
}


def log_y(ax: plt.Axes) -> None:
    """Logarithmic y axis with plain numbers."""
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter(LogFormatter(minor_thresholds=(1.5, 0.5)))


def few_ticks(axis) -> None:
    """Round numbers on a logarithmic axis, though it may be shorter than a decade."""
    low, high = sorted(axis.get_view_interval())
    axis.set_major_formatter("{x:g}")
    if high < 10 * low:
        axis.set_major_locator(plt.MaxNLocator(4))
        axis.set_minor_locator(plt.NullLocator())
    else:
        axis.set_minor_formatter(plt.NullFormatter())


def save(figure: plt.Figure, path: Path, dpi: int = 130) -> None:
    """Write the picture as PNG of 256 colours, a third of the size, and forget it."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=dpi)
    plt.close(figure)
    few = Image.open(drawn).convert("RGB")
    few = few.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    with replacing(path) as temporary:
        few.save(temporary, format="png")
