"""The parameters θ of a band's material, of N samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from sling2sim2real.base.parameters import THETA, parameters

EXTRA = tuple(  # of every law, after its own
    row.name for row in parameters("neo_hookean") if row.name not in THETA
)


@dataclass(frozen=True, eq=False)
class Parameters:
    """N samples of all parameters of a law; `names` says what a column is.

    Beside THETA and what the law adds (rubber.py) these are `air_drag`: of the
    moving band, force for its mass and speed [1/s], whatever brakes it besides the cylinder's drag;
    `turn_damping`: share of the damping that brakes a turn of a stressed band besides, 0 in a
    material, whose stress turns with it, 1 in engines that damp the rate of the nominal stress;
    `returned_share`: of the energy that the law gives a launch, what it truly gets.

    Attributes:
        law: NEO_HOOKEAN, RUBBER or COROTATED.
        values: Physical, shape (N, P).
    """

    law: str
    values: np.ndarray

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or self.values.shape[1] != len(self.names):
            raise ValueError(f"values {self.values.shape}: a column is needed for {self.names}")

    @classmethod
    def of(cls, law: str, theta: np.ndarray, **others: float | np.ndarray) -> Parameters:
        """Make parameters of THETA's values (N, 5) or (5,); others by name, one or one a sample."""
        return cls.named(law, dict(zip(THETA, np.asarray(theta, float).T, strict=True)) | others)

    @classmethod
    def named(
        cls,
        law: str,
        columns: Mapping[str, float | np.ndarray],
        others: Mapping[str, float] | None = None,
    ) -> Parameters:
        """Make samples of values by name, one or one a sample; `others` where `columns` has none.

        Raises:
            ValueError: A name is not one of the law, or one of THETA is missing.
        """
        given, rows = {**(others or {}), **columns}, parameters(law)
        if unknown := {*given} - {row.name for row in rows} | {*THETA} - {*given}:
            raise ValueError(f"of the law {law}: {', '.join(sorted(unknown))}")
        chosen = (given.get(row.name, row.default) for row in rows)
        values = np.broadcast_arrays(*(np.atleast_1d(np.asarray(value, float)) for value in chosen))
        return cls(law, np.stack(values, axis=1))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, length P."""
        return names_of(self.law)

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, chosen: slice | np.ndarray) -> Parameters:
        """Samples by a slice, by their numbers, or by a mask."""
        return Parameters(self.law, self.values[chosen])

    @property
    def theta(self) -> np.ndarray:
        """Values of THETA alone, shape (N, 5)."""
        return self.values[:, : len(THETA)]

    def column(self, name: str) -> np.ndarray:
        """Values of one parameter, shape (N,)."""
        return self.values[:, self.names.index(name)]

    def sample(self, number: int = 0) -> dict[str, float]:
        """One sample by its names."""
        return dict(zip(self.names, self.values[number].tolist(), strict=True))

    def changed(self, **columns: float | np.ndarray) -> Parameters:
        """The same with other columns, one or one a sample; of one sample, as many as they have."""
        retained = dict(zip(self.names, self.values.T, strict=True))
        return Parameters.named(self.law, retained | columns)

    def spread(self, count: int) -> Parameters:
        """`count` samples: these, or this one so many times."""
        return Parameters(self.law, np.broadcast_to(self.values, (count, len(self.names))))


@cache
def names_of(law: str) -> tuple[str, ...]:
    """All parameters of a law."""
    return tuple(row.name for row in parameters(law))
