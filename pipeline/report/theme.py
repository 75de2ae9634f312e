"""The look of all pictures, which are drawn without a screen."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")

COLORS = ("#d1495b", "#00798c", "#edae49", "#66a182", "#8d6a9f", "#2e4057", "#f17300", "#5b8e7d")
INK = "#222222"  # of what others are held against
STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
}
