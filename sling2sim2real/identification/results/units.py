"""SI units of what θ files hold; what is not here is a plain number."""

from __future__ import annotations

SI_UNITS = {
    "youngs_modulus": "Pa",
    "elasticity_damping": "s",
    "damping_product": "s",
    "air_drag": "1/s",
    "release_time": "s",
    "camera_delay": "s",
}
