"""Which coordinates of the density depend on each other."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from pipeline.report.figures.panels import panels
from sling2sim2real.drawing.canvas import picture
from sling2sim2real.drawing.styles import INK
from sling2sim2real.quantities import coordinate


@picture({"axes.grid": False})
def correlation(confidences: dict[str, dict]) -> Figure:
    """Correlations of the density's coordinates, a panel a band.

    Args:
        confidences: What the θ file of each band says of its confidence.
    """
    title = "Red or blue: the recording tells the two together better than each alone"
    figure, axes = panels(confidences, title, 3.4, columns=1)
    norm = Normalize(-1, 1)
    shades = ScalarMappable(norm, "RdBu_r")
    for band, ax in axes.items():
        correlations = confidences[band]["correlation"]
        matrix = np.array(correlations["matrix"], float)
        names = [coordinate(name) for name in correlations["names"]]
        ax.imshow(matrix, cmap=shades.cmap, norm=norm)
        for (row, column), value in np.ndenumerate(matrix):
            if column < row and abs(value) >= 0.05:
                ink = {"color": "w" if abs(value) > 0.6 else INK, "fontsize": 7}
                text = f"{value:+.1f}".replace("-", "−")
                ax.text(column, row, text, ha="center", va="center", **ink)
        ax.set_xticks(range(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
        ax.set_yticks(range(len(names)), names)
        ax.tick_params(length=0, labelsize=7)
        ax.spines[:].set_visible(False)
    figure.colorbar(shades, ax=list(axes.values()), label="correlation", shrink=0.8)
    return figure
