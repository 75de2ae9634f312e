"""How the policies converged."""

from __future__ import annotations

from pipeline.report.results import Results
from pipeline.report.tables.cells import NONE, Table, centimetres
from sling2sim2real.drawing.styles import Styles


def policies(results: Results, styles: Styles) -> Table:
    """How each policy converged in its own simulator, and how well its map interpolates."""
    heads = ["band", "method", "converged", "mean error [cm]", "largest", "failed targets"]
    rows = []
    for result in results:
        training, near = result.card["training"], result.card["landing_map"]["target_range"]
        rows.append(
            [
                result.band,
                styles[result.method].name,
                "yes" if training["converged"] else "**no**",
                *_errors(training),
                str(training.get("failed_targets", NONE)),
                *_errors(near),
            ]
        )
    return [*heads, "map error [cm]", "largest"], rows


def _errors(content: dict) -> list[str]:
    return [centimetres(content[name]) for name in ("mean_error_m", "max_error_m")]
