"""What parameters and derived quantities are called, and the units in which people read them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """One quantity of a θ file.

    Attributes:
        label: Its name in words.
        symbol: Its short name in tables and on axes.
        unit: In which people read it; "" of a plain number.
        factor: From SI (sling2sim2real/identification/results/units.py) to `unit`.
    """

    label: str
    symbol: str
    unit: str = ""
    factor: float = 1.0

    @property
    def heading(self) -> str:
        """Heading of a column or an axis, as in "E [kPa]"."""
        return f"{self.symbol} [{self.unit}]" if self.unit else self.symbol


QUANTITIES = {  # in the order of the cards
    "youngs_modulus": Quantity("Young's modulus", "E", "kPa", 1e-3),
    "mooney_share": Quantity("Mooney share", "Mooney share"),
    "upturn": Quantity("upturn of the stress", "upturn"),
    "softening": Quantity("softening by the first stretch", "softening", "%", 100.0),
    "relaxation": Quantity("stress relaxation per decade of time", "relaxation", "%", 100.0),
    "flow": Quantity("flowing share", "flow", "%", 100.0),
    "log_flow_rate": Quantity("log10 flow rate", "log10 flow rate"),
    "elasticity_damping": Quantity("damping time", "d", "ms", 1e3),
    "damping_scale": Quantity("damping scale", "s"),
    "poissons_ratio": Quantity("Poisson's ratio", "ν"),
    "dynamic_friction": Quantity("friction of the pads", "friction"),
    "damping_product": Quantity("damping scale × damping time", "damping s·d", "ms", 1e3),
    "air_drag": Quantity("extra air drag", "air drag", "1/s"),
    "turn_damping": Quantity("rotational damping share", "turn damping"),
    "returned_share": Quantity("energy returned at launch", "returned share", "%", 100.0),
    "release_time": Quantity("release", "release", "s"),
    "camera_delay": Quantity("delay of the camera", "camera delay", "ms", 1e3),
}


def coordinate(name: str) -> str:
    """A coordinate of the density (identification/posterior/coordinates.py) in words."""
    plain = name.removeprefix("log_")
    words = QUANTITIES[plain].symbol if plain in QUANTITIES else plain.replace("_", " ")
    return words if plain == name else f"log {words}"


def rounded(value: float, digits: int = 3) -> float:
    """Round to so many significant digits: another kind of CPU differs beyond them."""
    return float(f"{value:.{digits}g}")
