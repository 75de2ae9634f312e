"""A band in the simulator: its sizes, its parameters, how it hangs and how a hand draws it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, make_dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores, device
from sling2sim2real.base.parameters import Parameter, parameters
from sling2sim2real.base.schema import explained, read_json
from sling2sim2real.identification.results.theta import Mounting, ThetaFile, parameters_of
from sling2sim2real.launching.surface.landing_map import LandingMap
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandParams
from sling2sim2real.simulator.launch import Launches
from sling2sim2real.simulator.launch import launch as launch_many
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import THETA, Parameters, names_of
from sling2sim2real.simulator.rubber import NEO_HOOKEAN, RUBBER

ADDED = {row.name: row.default for row in parameters(RUBBER) if row.law}  # what the law adds


@dataclass(frozen=True)
class Band:
    """What a scale, a calliper and a ruler say of a band.

    >>> from sling2sim2real import Band
    >>> Band(mass=0.023, diameter=0.010, rest_length=0.52).name
    'band'
    >>> Band(mass=23, diameter=0.010, rest_length=0.52)
    Traceback (most recent call last):
    ...
    sling2sim2real.base.errors.UserError: Band: mass: must be between 0.0001 and 1, got 23 (kg, m)

    Attributes:
        mass: Between the clamps [kg].
        diameter: Unstretched [m].
        rest_length: Between the clamps, without force [m].
        name: Stands in messages and in episodes.
        preconditioned: Its largest draw before it was recorded [m]; True: farther than any since.
    """

    mass: float
    diameter: float
    rest_length: float
    name: str = "band"
    preconditioned: float | bool = False

    def __post_init__(self) -> None:
        sizes = {name: _plain(getattr(self, name)) for name in ("mass", "diameter", "rest_length")}
        try:
            BandParams.model_validate({"source": "recording", **sizes})
        except ValidationError as error:
            raise UserError(f"Band: {explained(error, BandParams)} (kg, m)") from error


def _field(row: Parameter) -> tuple:
    """Of a dataclass: THETA must be given, and what only rubber has is None unless it is."""
    if row.name in THETA:
        return row.name, float
    return (row.name, float | None, None) if row.law else (row.name, float, row.default)


_Values: Any = make_dataclass(
    "_Values", [*map(_field, parameters(RUBBER)), ("law", str, "")], frozen=True
)


@dataclass(frozen=True)
class Theta(_Values):
    """The parameters θ of a band, those of the table; the first five are the paper's.

    With some of those that are of rubber the material is of that law, without them it is
    neo-Hookean unless `law` says "corotated". A value that no material has is a UserError.

    >>> from sling2sim2real import Theta
    >>> five = Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6)
    >>> five.law
    'neo_hookean'
    >>> Theta(2.0e5, 0.55, 2.4e-3, 0.7, 0.6)
    Traceback (most recent call last):
    ...
    sling2sim2real.base.errors.UserError: theta.poissons_ratio: must be between 0 and 0.495, ...

    Attributes:
        youngs_modulus: For small strains, of rubber ten seconds after a sudden stretch [Pa].
        poissons_ratio: As usual.
        elasticity_damping: Viscous stress over the rate of the elastic one [s].
        dynamic_friction: Between finger pads and band.
        damping_scale: Of the part of the damping that brakes changes of shape, 0 to 1.
        mooney_share: Of rubber, Mooney's second constant over the sum of both.
        upturn: Of rubber, how much steeper it pulls far out: over (I1 - 3).
        softening: Of rubber, share of the stress that a first stretch takes away near rest.
        relaxation: Of rubber, share of the stress that relaxes in each decade of time.
        flow: Of rubber, share of the modulus that is added and flows, the faster, the larger its
            stress is.
        log_flow_rate: Of rubber, decadic logarithm of the flow's rate [1/s].
        air_drag: Beyond a cylinder's: force for mass and speed [1/s].
        turn_damping: Share of the damping that brakes turns without stretch.
        returned_share: Energy that a launch gets over what the law gives it.
        law: Of the material: neo_hookean, rubber or corotated.
    """

    def __post_init__(self) -> None:
        for attribute in fields(self):
            object.__setattr__(self, attribute.name, _plain(getattr(self, attribute.name)))
        if not self.law:
            of_rubber = any(getattr(self, name) is not None for name in ADDED)
            object.__setattr__(self, "law", RUBBER if of_rubber else NEO_HOOKEAN)
        if self.flow and self.log_flow_rate is None:
            raise UserError("theta.log_flow_rate: must be given beside flow")
        if self.law == RUBBER:
            for name, default in ADDED.items():
                if getattr(self, name) is None:
                    object.__setattr__(self, name, default)
        try:
            ThetaFile.model_validate(self.content("band", LaunchHistory(1.0, 0.0)))
        except ValidationError as error:
            raise UserError(explained(error, ThetaFile)) from error

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what `point` holds."""
        return names_of(self.law)

    @property
    def point(self) -> np.ndarray:
        """All of it in one vector, by `names`, shape (P,)."""
        return self.parameters.values[0]

    @property
    def parameters(self) -> Parameters:
        """Parameters as the simulator takes them, one sample."""
        return Parameters.named(self.law, {name: getattr(self, name) for name in self.names})

    @classmethod
    def of(cls, names: Sequence[str], point: np.ndarray, law: str = "") -> Theta:
        """Make θ from a vector (P,) by its names; the inverse of `point`."""
        values = dict(zip(names, np.asarray(point, float).tolist(), strict=True))
        return cls(**values, law=law)

    def content(self, band: str, history: LaunchHistory | None = None) -> dict:
        """What a θ file holds (`sling launch --theta`)."""
        named = {name: getattr(self, name) for name in (*THETA, *ADDED)}
        return {
            "band": band,
            **({} if self.law == NEO_HOOKEAN else {"law": self.law}),
            **({"history": history and vars(history)} if self.law == RUBBER else {}),
            "theta": {name: value for name, value in named.items() if value is not None},
            "nuisances": {"air_drag": self.air_drag},
            "turn_damping": self.turn_damping,
            "returned_share": self.returned_share,
        }

    @classmethod
    def load(cls, path: str | Path) -> Theta:
        """Read θ from a θ file, which a run or a person wrote. Raises UserError."""
        return cls.of_file(read_json(Path(path), ThetaFile))

    @classmethod
    def of_file(cls, file: ThetaFile) -> Theta:
        """Make θ from a θ file's content, checked."""
        parameters = parameters_of(file.model_dump(exclude_unset=True))
        return cls.of(parameters.names, parameters.values[0], parameters.law)


@dataclass(frozen=True)
class Model:
    """A band that can be simulated; what `identify` returns is one, with intervals.

    >>> from sling2sim2real import Band, Model, Theta
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6))
    >>> model.settings.setup.fork_width
    0.275

    Attributes:
        band, theta: Sizes and parameters.
        mounting: How the band leaves its clamps, and its bending stiffness; None: as
            `settings.setup` says, and a solid round band's.
        history: How long a hand draws a launched band and how long it pauses [s]; the law rubber
            remembers that. None: the band has forgotten everything. What `settings.launch` says
            goes first.
        settings: The lab and the simulator's resolution.
    """

    band: Band
    theta: Theta
    mounting: Mounting | None = None
    history: LaunchHistory | None = None
    settings: Settings = field(default_factory=Settings.default, repr=False)

    def __post_init__(self) -> None:
        with_band(self.settings, self.band)

    @property
    def parameters(self) -> Parameters:
        """θ as the simulator takes it, one sample."""
        return self.theta.parameters

    @cached_property
    def sling(self) -> ClampedBand:
        """The band as the simulator takes it."""
        lab = self.settings.setup, self.settings.sling
        return ClampedBand.of(self.band, *lab, self.mounting, law=self.theta.law)

    @cached_property
    def launch_setup(self) -> LaunchSetup:
        """How it is launched."""
        return LaunchSetup.of(self.settings.setup, self.settings.sling, self._history())

    @cached_property
    def landing_map(self) -> LandingMap:
        """Launches over the box of draws (`settings.setup`), and splines that read between them."""
        setup = self.settings.setup
        return LandingMap.simulate(
            self.launches,
            draw_y=setup.draw_y,
            draw_z=setup.draw_z,
            size=self.settings.policy.map_size,
            max_force=setup.max_force,
        )

    def launches(self, draws: np.ndarray, points: np.ndarray | None = None) -> Launches:
        """Launch draws (N, 2) [m], each by θ or by a point of its own (N, P) as `Theta.point`.

        No arm limits the force here. SLING_DEVICE says where they are simulated.
        """
        draws = np.atleast_2d(np.asarray(draws, float))
        law = self.theta.law
        parameters = self.theta.parameters if points is None else Parameters(law, points)
        return launch_many(
            self.sling, self.launch_setup, parameters, draws, device=device(), workers=cores()
        )

    def _history(self) -> LaunchHistory | None:
        pull_history = dict(vars(self.history)) if self.history else {}
        pull_history |= {name: value for name, value in self.settings.launch if value is not None}
        complete = {"pull_time", "pause"} <= {*pull_history}
        return LaunchHistory(**pull_history) if self.theta.law == RUBBER and complete else None


def with_band(settings: Settings, band: Band) -> Settings:
    """Settings that know the band by its name. Raises UserError where it cannot be."""
    sizes = {name: _plain(getattr(band, name)) for name in ("mass", "diameter", "rest_length")}
    there = settings.bands.get(band.name)
    source = there.source if there else "recording"
    return settings.changed(bands={band.name: {"source": source, **sizes}})


def _plain(value: object) -> object:
    """NumPy's numbers as Python's; anything else as it is, for the schema to judge."""
    return float(value) if isinstance(value, np.number) else value
