"""The sling of a band of params.yaml, as its recording has calibrated the clamps."""

from __future__ import annotations

import json
from pathlib import Path

from pipeline.base.layout import Layout, NotMade
from pipeline.sling.model import Sling


def load_sling(params, band: str, root: str | Path = ".") -> Sling:
    """The sling of a band of params.yaml, mounted as its recording shows where that was fitted."""
    path, mounting = Layout(Path(root)).mounting(band), None
    if path.exists():
        try:
            mounting = json.loads(path.read_text(encoding="utf-8"))
            mounting["clamp_direction"], mounting["flexural_rigidity"]
        except (ValueError, KeyError, TypeError) as error:
            raise NotMade(path, "damaged") from error
    return Sling.of(params.bands[band], params.setup, params.sling, mounting)
