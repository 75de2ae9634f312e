"""The sling of a band of params.yaml, as its recording has calibrated the clamps."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.sling.model import Sling


def mounting_path(band: str, root: str | Path = ".") -> Path:
    return Path(root, "data", "mounting", f"{band}.json")


def load_sling(params, band: str, root: str | Path = ".") -> Sling:
    """The sling of a band of params.yaml, mounted as its recording shows where that was fitted."""
    path = mounting_path(band, root)
    mounting = None
    if path.exists():
        try:
            mounting = json.loads(path.read_text(encoding="utf-8"))
            mounting["clamp_direction"], mounting["flexural_rigidity"]
        except (ValueError, KeyError, TypeError) as error:
            raise UserError(
                f"{path}: damaged; `dvc repro --force mounting@{band}` makes it anew"
            ) from error
    else:
        print(
            f"note: {path} is missing, so the band hangs as `setup` says; `dvc repro"
            f" mounting@{band}` fits it to a recording",
            file=sys.stderr,
        )
    return Sling.of(params.bands[band], params.setup, params.sling, mounting)
