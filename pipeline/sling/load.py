"""The sling of a band of params.yaml, as its recording has calibrated the clamps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pipeline.base.layout import Layout
from pipeline.base.schema import Direction, JsonRecord, Range, read_json
from pipeline.sling.model import Sling
from pipeline.sling.rubber import NEO_HOOKEAN


class Mounting(JsonRecord):
    """How a band leaves its clamps, and its flexural rigidity [N m^2]."""

    clamp_direction: Direction
    flexural_rigidity: Annotated[float, Range(0, 1e3)]


def load_sling(params, band: str, root: str | Path = ".", law: str = NEO_HOOKEAN) -> Sling:
    """The sling of a band of params.yaml, mounted as its recording shows where that was fitted.

    Raises NotMade where the file of the mounting is damaged.
    """
    path = Layout(Path(root)).mounting(band)
    mounting = read_json(path, Mounting).model_dump() if path.exists() else None
    sling = Sling.of(params.bands[band], params.setup, params.sling, mounting)
    return replace(sling, law=law)
