"""Elastic laws of incompressible rubber in uniaxial tension: nominal stress by stretch, MPa.

Of a law only the shape matters: a band's own factor (`Rubber.scale`) multiplies it. The constants
of Gent's law, of the eight chains and of the tubes are fitted as Ogden's are, to Treloar's points;
they are not those of the papers that are named, none of which we could open.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np


class Law(Protocol):
    """An elastic law."""

    @cached_property
    def modulus(self) -> float:
        """Young's modulus, dP/dl at l = 1 [MPa]."""
        ...

    def stress(self, stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nominal stress P [MPa] and its derivative by stretch, shapes as given."""
        ...

    def energy(self, stretch: np.ndarray) -> np.ndarray:
        """Work of the nominal stress from 1 to `stretch` [MJ/m3]."""
        ...


@dataclass(frozen=True)
class Ogden:
    """P(l) = sum_i mu_i (l^(a_i - 1) - l^(-a_i/2 - 1)): Ogden, Proc. R. Soc. A 326 (1972) 565.

    The terms here are fitted to the uniaxial points of Treloar, Trans. Faraday Soc. 40 (1944) 59
    (relative errors, RMS 1.7 %), with his equibiaxial points, read as uniaxial compression, at a
    tenth of the weight: the tests of this folder repeat the fit. mu_i a_i > 0 makes P grow with l
    everywhere.

    Attributes:
        terms: Pairs of mu_i [MPa] and a_i.
    """

    terms: tuple[tuple[float, float], ...] = (
        (4.38677e-02, 3.153406),
        (1.91199e-10, 12.467417),
        (-5.25868, -0.134005),
    )

    @cached_property
    def _powers(self) -> np.ndarray:
        exponents = np.array([exponent for _, exponent in self.terms])
        return np.concatenate([exponents - 1, -exponents / 2 - 1])

    @cached_property
    def _table(self) -> np.ndarray:
        """Of P and of l dP/dl, shape (2, 2 terms)."""
        moduli = np.array([modulus for modulus, _ in self.terms])
        factors = np.concatenate([moduli, -moduli])
        return np.stack([factors, factors * self._powers])

    @cached_property
    def modulus(self) -> float:
        return float(self._table[1].sum())

    def stress(self, stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        powers = np.exp(np.multiply.outer(self._powers, np.log(stretch)))
        stress, slope = np.tensordot(self._table, powers, axes=1)
        return stress, slope / stretch

    def energy(self, stretch: np.ndarray) -> np.ndarray:
        mode = lambda a: (stretch**a - 1) / a + 2 * (stretch ** (-a / 2) - 1) / a  # noqa: E731
        return sum((m * mode(a) for m, a in self.terms), np.zeros(()))


class _OfInvariant:
    """A law whose energy depends on D = l^2 + 2/l - 3 alone: P = 2 W'(D) (l - l^-2)."""

    def _factor(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """2 W'(D) and 2 W''(D)."""
        raise NotImplementedError

    def _density(self, d: np.ndarray) -> np.ndarray:
        """W(D)."""
        raise NotImplementedError

    @cached_property
    def modulus(self) -> float:
        return float(self.stress(np.ones(()))[1])

    def stress(self, stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        inverse = 1 / stretch
        shear = stretch - inverse**2
        factor, change = self._factor(stretch**2 + 2 * inverse - 3)
        return factor * shear, factor * (1 + 2 * inverse**3) + 2 * change * shear**2

    def energy(self, stretch: np.ndarray) -> np.ndarray:
        return self._density(stretch**2 + 2 / stretch - 3)


@dataclass(frozen=True)
class Gent(_OfInvariant):
    """W = -(G J/2) ln(1 - D/J): Gent, Rubber Chem. Technol. 69 (1996) 59.

    Attributes:
        limit: J, where D locks.
        shear: G [MPa].
    """

    limit: float = 94.1
    shear: float = 0.301

    def _factor(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        left = self.shear * self.limit / (self.limit - d)
        return left, left / (self.limit - d)

    def _density(self, d: np.ndarray) -> np.ndarray:
        return -self.shear * self.limit / 2 * np.log1p(-d / self.limit)


@dataclass(frozen=True)
class EightChain(_OfInvariant):
    """2 W'(D) = G/3 sqrt(N)/c L^-1(c/sqrt(N)), c^2 = D/3 + 1: Arruda, Boyce, JMPS 41 (1993) 389.

    The inverse Langevin function is Cohen's fraction, L^-1(y) = y (3 - y^2)/(1 - y^2) (Rheol. Acta
    30 (1991) 270), at most 5 % off, and the energy is the integral of that: G N (q/2 - ln(1 - q)),
    q = c^2/N.

    Attributes:
        segments: N, of each chain: it locks where q is 1.
        shear: G [MPa].
    """

    segments: float = 27.6
    shear: float = 0.298

    def _factor(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q = (d / 3 + 1) / self.segments
        left = 1 - q
        return self.shear / 3 * (1 + 2 / left), self.shear / (4.5 * self.segments) / left**2

    def _density(self, d: np.ndarray) -> np.ndarray:
        start, more = 1 / self.segments, d / (3 * self.segments)
        bent = more / 2 - np.log1p(-more / (1 - start))
        return self.shear * self.segments * bent


@dataclass(frozen=True)
class ExtendedTube(_OfInvariant):
    """Chains of finite length in tubes: Kaliske, Heinrich, Rubber Chem. Technol. 72 (1999) 602.

    W = Gc/2 [(1 - e^2) D/(1 - e^2 D) + ln(1 - e^2 D)] + 2 Ge/b^2 sum_i (l_i^-b - 1)

    as the library FElupe has it, which names that paper; the tubes' part is a term of Ogden's.

    Attributes:
        extensibility: e; D locks at 1/e^2.
        release: b, how much of the tubes gives way.
        tubes: Ge / Gc.
        shear: Gc [MPa].
    """

    extensibility: float = 0.0954
    release: float = 0.331
    tubes: float = 1.111
    shear: float = 0.195

    @cached_property
    def _constraint(self) -> Ogden:
        return Ogden(((-2 * self.tubes * self.shear / self.release, -self.release),))

    def _factor(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        e2 = self.extensibility**2
        left = 1 - e2 * d
        factor = (1 - e2) / left**2 - e2 / left
        change = 2 * e2 * (1 - e2) / left**3 - (e2 / left) ** 2
        return self.shear * factor, self.shear * change

    def _density(self, d: np.ndarray) -> np.ndarray:
        e2 = self.extensibility**2
        return self.shear / 2 * ((1 - e2) * d / (1 - e2 * d) + np.log1p(-e2 * d))

    def stress(self, stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        stress, slope = super().stress(stretch)
        more, steeper = self._constraint.stress(stretch)
        return stress + more, slope + steeper

    def energy(self, stretch: np.ndarray) -> np.ndarray:
        return super().energy(stretch) + self._constraint.energy(stretch)


TRELOAR = Ogden()
LAWS = {"ogden": Ogden, "gent": Gent, "arruda_boyce": EightChain, "extended_tube": ExtendedTube}


def law_of(name: str, constants: tuple[float, ...]) -> Law:
    """A law with constants of its own, in the order of its class, or with ours where none are.

    Those of Ogden's are its terms one after the other.
    """
    if name == "ogden" and constants:
        return Ogden(tuple(zip(constants[::2], constants[1::2], strict=True)))
    return LAWS[name](*constants)
