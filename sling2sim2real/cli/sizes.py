"""A band that params.yaml does not have yet, by its sizes."""

from __future__ import annotations

from sling2sim2real.base.errors import UserError
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandParams

DIAMETER, REST_LENGTH = 0.010, 0.52  # m: of a common band, where nothing is given
MASS = 0.03  # kg: stands for what is not known, and nothing is judged by it


def band_to_come(
    params: Settings,
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


def assumed(diameter: float | None, rest_length: float | None) -> str:
    """Which sizes of a common band stand for those that are not given; "" where all are."""
    sizes = (("--diameter", diameter, DIAMETER), ("--rest-length", rest_length, REST_LENGTH))
    return " and ".join(f"{name} {usual:g}" for name, given, usual in sizes if given is None)
