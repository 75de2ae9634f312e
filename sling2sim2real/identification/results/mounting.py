"""A clamped band of params.yaml, with the clamps as its recording has calibrated them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from sling2sim2real.base.schema import Direction, JsonRecord, Range, read_json
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.rubber import NEO_HOOKEAN


class Mounting(JsonRecord):
    """How a band leaves its clamps, and its flexural rigidity [N m^2]."""

    clamp_direction: Direction
    flexural_rigidity: Annotated[float, Range(0, 1e3)]


def load_sling(
    params: Settings,
    band: str,
    clamps: Path | None,
    law: str = NEO_HOOKEAN,
    *,
    mounted: bool = True,
) -> ClampedBand:
    """A band of params.yaml, mounted as its recording shows where that was fitted.

    Args:
        clamps: File of the mounting that was fitted; without one the band hangs as `setup` says.
        mounted: False leaves out what was fitted.

    Raises NotMade where the file of the mounting is damaged.
    """
    mounting = None
    if mounted and clamps is not None and clamps.exists():
        mounting = read_json(clamps, Mounting)
    return ClampedBand.of(params.bands[band], params.setup, params.sling, mounting, law=law)


def sling_of_method(params: Settings, band: str, method: str, clamps: Path | None) -> ClampedBand:
    """A band as a method of params.yaml takes it: with its law, mounted or not."""
    method_params = params.methods[method]
    return load_sling(params, band, clamps, method_params.law, mounted=method_params.mounting)
