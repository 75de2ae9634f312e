"""How a method is named and coloured in every table and picture, and how all pictures look."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import cycle

import matplotlib

matplotlib.use("Agg")  # drawn without a screen

COLORS = ("#d1495b", "#00798c", "#edae49", "#66a182", "#8d6a9f", "#2e4057", "#f17300", "#5b8e7d")
INK = "#222222"  # of what others are held against
THEME = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
}
# Red is the posterior, teal the paper's method, blue to violet its ablations, yellow to brown other
# optimisers, green the geometry-only baselines. Ablations and optimisers have the paper's names.
KNOWN = {
    "posterior": ("posterior", "#d1495b"),
    "paper": ("paper", "#00798c"),
    "no_covariance": ("−c", "#3a5ba0"),
    "no_multistart": ("−m", "#6f9bd8"),
    "no_covariance_no_multistart": ("−c, −m", "#8d6a9f"),
    "no_work": ("−L_work", "#c08bbd"),
    "de": ("DE_L", "#edae49"),
    "bo": ("BO_L", "#f17300"),
    "adam": ("Adam_L", "#8a5a2b"),
    "real2sim2real": ("Real2Sim2Real", "#7fb069"),
    "package_si": ("Package SI", "#33673b"),
}
SPARE = ("#2e4057", "#8c8c8c", "#c2187b", "#00b5a0", "#5e35b1", "#9e9d24")  # of a user's methods


@dataclass(frozen=True)
class Style:
    """A method's name for readers, and its colour."""

    name: str
    color: str


Styles = dict[str, Style]  # by method


def styles(methods: Iterable[str]) -> Styles:
    """A style for each method; one that the paper and we do not have keeps its own name."""
    spare = cycle(SPARE)
    return {m: Style(*(KNOWN.get(m) or (m, next(spare)))) for m in methods}
