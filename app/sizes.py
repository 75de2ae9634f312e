"""A band that params.yaml does not have yet, by its sizes."""

from __future__ import annotations

from pipeline.base.errors import UserError
from pipeline.params import Params
from pipeline.params.lab import BandParams

MASS, DIAMETER, REST_LENGTH = 0.03, 0.010, 0.52  # kg, m: of a common band, where nothing is given


def band_to_come(
    params: Params,
    mass: float | None = None,
    diameter: float | None = None,
    rest_length: float | None = None,
) -> BandParams:
    """Band with common values for None. Raises UserError where it does not reach the tips."""
    band = BandParams(
        source="recording",
        mass=mass or MASS,
        diameter=diameter or DIAMETER,
        rest_length=rest_length or REST_LENGTH,
    )
    if band.rest_length <= params.setup.fork_width:
        raise UserError(
            f"--rest-length {band.rest_length:g}: must be longer than setup.fork_width"
            f" {params.setup.fork_width:g}"
        )
    return band
