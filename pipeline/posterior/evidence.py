"""Launches that are evidence: data/evidence/<band>.csv, which `sling observe` writes.

Columns draw_y_m, draw_z_m, draw_error_m, landing_y_m. A launch is evidence or a score
(data/trials/measured/), never both.
"""

from __future__ import annotations

from pathlib import Path

from pipeline.posterior.launches import Observed


def read_evidence(folder: Path, band: str, params) -> list[Observed]:
    """Of a band, oldest first; none where it has no file. Raises UserError."""
    return []
