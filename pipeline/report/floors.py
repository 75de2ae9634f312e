"""The actuation floor of a band, as its stage wrote it; no method may read it."""

from __future__ import annotations

import json
from pathlib import Path

from pipeline.base.layout import NotMade, made

NUMBERS = ("launches", "actuation_error_m", "release_jitter")


def load_floor(path: Path) -> dict:
    """Read what stages/floor.py wrote. Raises NotMade."""
    made(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        [float(content[name]) for name in NUMBERS]
        means = [one["mean_error_m"] for one in (content, *content["targets"].values())]
        [float(mean) for mean in means if mean is not None]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise NotMade(path, "damaged") from error
    return content
