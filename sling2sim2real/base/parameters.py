"""The one table of parameters and of what derives from them.

A row says all that anything needs to know of a parameter: the search box and its checks, the
density's coordinates, θ files, cards, tables and exports derive from it. Who adds one to a law
writes a row here and its use in the kernel (simulator/material.py), bounds in the methods of
params.yaml that search it, and a row in docs/glossary.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class Quantity:
    """One quantity of a θ file.

    Attributes:
        label: Its name in words.
        symbol: Its short name in tables and on axes.
        si: Its SI unit; "" of a plain number.
        read: The unit in which people read it, and the factor to that from SI; None: SI.
    """

    name: str
    label: str
    symbol: str
    si: str = ""
    read: tuple[str, float] | None = None

    @property
    def unit(self) -> str:
        return self.read[0] if self.read else self.si

    @property
    def factor(self) -> float:
        return self.read[1] if self.read else 1.0

    @property
    def heading(self) -> str:
        """Heading of a column or an axis, as in "E [kPa]"."""
        return f"{self.symbol} [{self.unit}]" if self.unit else self.symbol


@dataclass(frozen=True)
class Coordinate:
    """How the density sees a parameter.

    Attributes:
        step: Of finite differences.
        prior: Mean and standard deviation of a Gaussian; None: even within the bounds.
        rectified: What of that Gaussian lies below its mean is at it: half of the prior.
        bounds: None: those of the method's box.
        log: The coordinate is the parameter's logarithm.
        name: Its own; "": the parameter's, `log_` before it where it is the logarithm.
    """

    step: float
    prior: tuple[float, float] | None = None
    rectified: bool = False
    bounds: tuple[float, float] | None = None
    log: bool = False
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Parameter(Quantity):
    """One parameter of a band's material.

    Attributes:
        reach: How far a box, or a θ file, may reach.
        box, scale: Within which searches look for it, unless params.yaml says otherwise. What is
            of every law beside THETA only a density looks for, within its coordinate's bounds.
        law: Whose it is; "": of every law.
        fixed: At what a density fixes it; None: it does not.
        default: Where nothing says it; None: something must.
        coordinate: None: no pull shows it, and a method that fits a density fixes it.
    """

    reach: tuple[float, float]
    box: tuple[float, float] = (0.0, 1.0)
    scale: Literal["linear", "log"] = "linear"
    law: str = ""
    fixed: float | None = None
    default: float | None = 0.0
    coordinate: Coordinate | None = None

    @property
    def shown_by(self) -> str:
        """Name of its coordinate. Raises ValueError where there is none."""
        if self.coordinate is None:
            raise ValueError(f"{self.name}: no coordinate shows it")
        return self.coordinate.name or ("log_" if self.coordinate.log else "") + self.name


PERCENT, MILLISECONDS = ("%", 100.0), ("ms", 1e3)
# Of 9 in 10 rubbers at 10 to 100 Hz: the range from butadiene to butyl rubber, by
# https://materialmap.github.io/rubber_damping_reference.html.
# A band with both ends held swings at pi c/L, where its damping s d makes tan delta = pi s d c/L.
TAN_DELTA = 0.03, 0.50
LOSS_FACTOR = (
    float(np.log(np.sqrt(np.prod(TAN_DELTA)) / np.pi)),
    float(np.log(TAN_DELTA[1] / TAN_DELTA[0]) / 2 / 1.645),
)
RUBBER = "rubber"
TABLE: tuple[Quantity, ...] = (  # in the order of the cards
    Parameter(
        name="youngs_modulus",
        label="Young's modulus",
        symbol="E",
        si="Pa",
        read=("kPa", 1e-3),
        reach=(1e3, 1e9),
        box=(3e4, 1e7),
        scale="log",
        default=None,
        coordinate=Coordinate(0.005, log=True),
    ),
    Parameter(
        name="mooney_share",
        label="Mooney share",
        symbol="Mooney share",
        reach=(-1.0, 1.0),
        box=(-1.0, 0.9),
        law=RUBBER,
        coordinate=Coordinate(0.02),
    ),
    Parameter(
        name="upturn",
        label="upturn of the stress",
        symbol="upturn",
        reach=(0.0, 1.0),
        box=(0.0, 0.3),
        law=RUBBER,
        coordinate=Coordinate(0.01),
    ),
    # Rectified: slow cycles of elastomers return 64 to 82 % (10.5281/zenodo.14717689), by
    # softening alone 1 - 0.59 s, and by flow alone 1 - 2 flow or more.
    Parameter(
        name="softening",
        label="softening by the first stretch",
        symbol="softening",
        read=PERCENT,
        reach=(0.0, 0.9),
        box=(0.0, 0.6),
        law=RUBBER,
        coordinate=Coordinate(0.02, prior=(0.0, 0.3), rectified=True),
    ),
    Parameter(
        name="relaxation",
        label="stress relaxation per decade of time",
        symbol="relaxation",
        read=PERCENT,
        reach=(0.0, 0.2),
        box=(0.0, 0.2),
        law=RUBBER,
        coordinate=Coordinate(0.004),
    ),
    Parameter(
        name="flow",
        label="flowing share",
        symbol="flow",
        read=PERCENT,
        reach=(0.0, 1.0),
        box=(0.0, 0.6),
        law=RUBBER,
        coordinate=Coordinate(0.01, prior=(0.0, 0.15), rectified=True),
    ),
    Parameter(
        name="log_flow_rate",
        label="log10 flow rate",
        symbol="log10 flow rate",
        reach=(-1.0, 6.0),
        box=(0.0, 5.0),
        law=RUBBER,
        # a stress of E/5 flows in a second, within a decade
        coordinate=Coordinate(0.03, prior=(2.0, 1.0)),
    ),
    Parameter(
        name="elasticity_damping",
        label="damping time",
        symbol="d",
        si="s",
        read=MILLISECONDS,
        reach=(1e-6, 1.0),
        box=(1e-4, 5e-2),
        scale="log",
        default=None,
        # that of the loss factor s d c/L, which identification/posterior/coordinates.py explains
        coordinate=Coordinate(0.05, prior=LOSS_FACTOR, log=True, name="log_loss_factor"),
    ),
    Parameter(
        name="damping_scale",
        label="damping scale",
        symbol="s",
        reach=(0.0, 1.0),
        box=(0.0, 1.0),
        fixed=0.6,
        default=None,
    ),
    Parameter(
        name="poissons_ratio",
        label="Poisson's ratio",
        symbol="ν",
        reach=(0.0, 0.495),
        box=(0.3, 0.49),
        fixed=0.47,
        default=None,
    ),
    Parameter(
        name="dynamic_friction",
        label="friction of the pads",
        symbol="friction",
        reach=(0.0, 5.0),
        box=(0.05, 1.0),
        fixed=0.8,
        default=None,
    ),
    Quantity("damping_product", "damping scale × damping time", "damping s·d", "s", MILLISECONDS),
    Parameter(
        name="air_drag",
        label="extra air drag",
        symbol="air drag",
        si="1/s",
        reach=(0.0, 50.0),
        # little beside the cylinder's drag
        coordinate=Coordinate(0.25, prior=(0.0, 1.0), rectified=True, bounds=(0.0, 8.0)),
    ),
    Parameter(
        name="turn_damping",
        label="rotational damping share",
        symbol="turn damping",
        reach=(0.0, 1.0),
        coordinate=Coordinate(0.1, bounds=(0.0, 1.0)),
    ),
    Parameter(
        name="returned_share",
        label="energy returned at launch",
        symbol="returned share",
        read=PERCENT,
        reach=(0.1, 10.0),
        default=1.0,
        # The law's discrepancy, common to a band's launches: by so much the energy of 55 measured
        # pellets differs from a rod's that three others of their band have fixed
        # (reports/validation/real-launches.json, returned_energy).
        coordinate=Coordinate(0.01, prior=(0.0, 0.016), bounds=(-0.3, 0.3), log=True),
    ),
    Quantity("release_time", "release", "release", "s"),
    Quantity("camera_delay", "delay of the camera", "camera delay", "s", MILLISECONDS),
)
THETA = (  # those of every law that a θ file must say, in the paper's order
    "youngs_modulus",
    "poissons_ratio",
    "elasticity_damping",
    "dynamic_friction",
    "damping_scale",
)


def parameters(law: str) -> tuple[Parameter, ...]:
    """All parameters of a law: THETA, what the law adds, and the others of every law."""
    rows = {row.name: row for row in TABLE if isinstance(row, Parameter)}
    added = [row for row in rows.values() if row.law == law]
    others = [row for row in rows.values() if not row.law and row.name not in THETA]
    return (*(rows[name] for name in THETA), *added, *others)


def added_by(law: str) -> dict[str, tuple[float, float]]:
    """What a law has beside the parameters of every law, and how far each may reach."""
    return {row.name: row.reach for row in parameters(law) if row.law}
