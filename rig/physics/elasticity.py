"""Elastic laws of incompressible rubber in uniaxial tension: nominal stress by stretch, MPa.

Each is one function of a stretch l and the law's constants: energy [MJ/m3] (the work of the nominal
stress from 1 to l), nominal stress P and dP/dl [MPa]. A new one also stands in LAWS and `at`.

Of a law only the shape matters: a band's own factor (`Rubber.scale`) multiplies it. The constants
of all laws but Ogden's are fitted as Ogden's are, to Treloar's points;
they are not those of the papers that are named, none of which we could open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rig.physics.compiled import compiled

Point = tuple[float, float, float]
"""Energy, stress and its slope."""


@compiled
def ogden(stretch: float, constants: Sequence[float]) -> Point:
    """P(l) = sum_i mu_i (l^(a_i - 1) - l^(-a_i/2 - 1)): Ogden, Proc. R. Soc. A 326 (1972) 565.

    Constants: mu_i [MPa] and a_i, one after the other. Those of LAWS are fitted to the uniaxial
    points of Treloar, Trans. Faraday Soc. 40 (1944) 59 (relative errors, RMS 1.7 %), with his
    equibiaxial points, read as uniaxial compression, at a tenth of the weight: the tests of this
    folder repeat the fit. mu_i a_i > 0 makes P grow with l everywhere.
    """
    energy = stress = slope = 0.0
    log = np.log(stretch)
    for i in range(0, len(constants), 2):
        mu, a = constants[i], constants[i + 1]
        along = np.exp(a * log)
        across = 1 / np.sqrt(along)
        energy += mu * (along - 1 + 2 * (across - 1)) / a
        stress += mu * (along - across)
        slope += mu * ((a - 1) * along + (a / 2 + 1) * across)
    return energy, stress / stretch, slope / stretch**2


@compiled
def of_invariant(stretch: float, energy: float, factor: float, change: float) -> Point:
    """A law whose energy W depends on D = l^2 + 2/l - 3 alone: P = 2 W'(D) (l - l^-2).

    Args:
        factor, change: 2 W'(D) and 2 W''(D).
    """
    inverse = 1 / stretch
    shear = stretch - inverse**2
    return energy, factor * shear, factor * (1 + 2 * inverse**3) + 2 * change * shear**2


@compiled
def gent(stretch: float, constants: Sequence[float]) -> Point:
    """W = -(G J/2) ln(1 - D/J): Gent, Rubber Chem. Technol. 69 (1996) 59.

    Constants: J, where D locks, and G [MPa].
    """
    limit, shear = constants[0], constants[1]
    d = stretch**2 + 2 / stretch - 3
    factor = shear * limit / (limit - d)
    energy = -shear * limit / 2 * np.log1p(-d / limit)
    return of_invariant(stretch, energy, factor, factor / (limit - d))


@compiled
def eight_chain(stretch: float, constants: Sequence[float]) -> Point:
    """2 W'(D) = G/3 sqrt(N)/c L^-1(c/sqrt(N)), c^2 = D/3 + 1: Arruda, Boyce, JMPS 41 (1993) 389.

    The inverse Langevin function is Cohen's fraction, L^-1(y) = y (3 - y^2)/(1 - y^2) (Rheol. Acta
    30 (1991) 270), at most 5 % off, and the energy is the integral of that: G N (q/2 - ln(1 - q)),
    q = c^2/N. Constants: N, the segments of a chain, which locks where q is 1, and G [MPa].
    """
    segments, shear = constants[0], constants[1]
    d = stretch**2 + 2 / stretch - 3
    left = 1 - (d / 3 + 1) / segments
    more = d / (3 * segments)
    energy = shear * segments * (more / 2 - np.log1p(-more / (1 - 1 / segments)))
    factor, change = shear / 3 * (1 + 2 / left), shear / (4.5 * segments) / left**2
    return of_invariant(stretch, energy, factor, change)


@compiled
def extended_tube(stretch: float, constants: Sequence[float]) -> Point:
    """Chains of finite length in tubes: Kaliske, Heinrich, Rubber Chem. Technol. 72 (1999) 602.

    W = Gc/2 [(1 - e^2) D/(1 - e^2 D) + ln(1 - e^2 D)] + 2 Ge/b^2 sum_i (l_i^-b - 1)

    as the library FElupe has it, which names that paper; the tubes' part is a term of Ogden's.
    Constants: e (D locks at 1/e^2), b (how much of the tubes gives way), Ge/Gc, and Gc [MPa].
    """
    e2, release, tubes, shear = constants[0] ** 2, constants[1], constants[2], constants[3]
    d = stretch**2 + 2 / stretch - 3
    left = 1 - e2 * d
    factor = shear * ((1 - e2) / left**2 - e2 / left)
    change = shear * (2 * e2 * (1 - e2) / left**3 - (e2 / left) ** 2)
    energy = shear / 2 * ((1 - e2) * d / left + np.log1p(-e2 * d))
    chains = of_invariant(stretch, energy, factor, change)
    tube = ogden(stretch, (-2 * tubes * shear / release, -release))
    return chains[0] + tube[0], chains[1] + tube[1], chains[2] + tube[2]


@compiled
def carroll(stretch: float, constants: Sequence[float]) -> Point:
    """W = A I1 + B I1^4 + C I2^(1/2): Carroll, J. Elast. 103 (2011) 173, which we could not open.

    Constants: A, B, C [MPa].
    """
    a, b, c = constants[0], constants[1], constants[2]
    inverse = 1 / stretch
    i1, i2 = stretch**2 + 2 * inverse, 2 * stretch + inverse**2
    root = np.sqrt(i2)
    first = of_invariant(
        stretch, a * (i1 - 3) + b * (i1**4 - 81), 2 * (a + 4 * b * i1**3), 24 * b * i1**2
    )
    across = 1 - inverse**3  # half of dI2/dl
    slope = c * (3 * inverse**4 / root - across**2 / root**3)
    return first[0] + c * (root - np.sqrt(3.0)), first[1] + c * across / root, first[2] + slope


@compiled
def lopez_pamies(stretch: float, constants: Sequence[float]) -> Point:
    """W = sum_i 3^(1-a_i)/(2 a_i) mu_i (I1^a_i - 3^a_i): Lopez-Pamies, C. R. Mec. 338 (2010) 3.

    We could not open the paper. Constants: mu_1 [MPa], a_1, mu_2 [MPa], a_2.
    """
    i1 = stretch**2 + 2 / stretch
    energy = factor = change = 0.0
    for i in (0, 2):
        mu, a = constants[i], constants[i + 1]
        part = 3 ** (1 - a) * mu * i1 ** (a - 1)
        energy += (part * i1 - 3 * mu) / (2 * a)
        factor += part
        change += (a - 1) * part / i1
    return of_invariant(stretch, energy, factor, change)


LAWS = {  # and their constants by Treloar's points
    "ogden": (4.38677e-02, 3.153406, 1.91199e-10, 12.467417, -5.25868, -0.134005),
    "gent": (94.1, 0.301),
    "arruda_boyce": (27.6, 0.298),
    "extended_tube": (0.0954, 0.331, 1.111, 0.195),
    "carroll": (0.13575, 3.3398e-07, 0.22564),
    "lopez_pamies": (0.37814, 0.71078, 2.6963e-03, 2.8197),
}
NUMBERS = {name: number for number, name in enumerate(LAWS)}


@compiled
def at(number: int, stretch: float, constants: Sequence[float]) -> Point:
    """The law of that number in LAWS."""
    if number == 0:
        return ogden(stretch, constants)
    if number == 1:
        return gent(stretch, constants)
    if number == 2:
        return eight_chain(stretch, constants)
    if number == 3:
        return extended_tube(stretch, constants)
    if number == 4:
        return carroll(stretch, constants)
    return lopez_pamies(stretch, constants)


@compiled
def _over(number: int, stretches: np.ndarray, constants: np.ndarray) -> np.ndarray:
    """`at` of each stretch (N,), shape (3, N)."""
    values = np.empty((3, len(stretches)))
    for i in range(len(stretches)):
        values[0, i], values[1, i], values[2, i] = at(number, stretches[i], constants)
    return values


@dataclass(frozen=True)
class Law:
    """An elastic law by its name in LAWS, with all its constants."""

    name: str
    constants: tuple[float, ...]

    @cached_property
    def modulus(self) -> float:
        """Young's modulus, dP/dl at l = 1 [MPa]."""
        return float(self.stress(np.ones(()))[1])

    def _points(self, stretch: np.ndarray) -> np.ndarray:
        flat = np.ascontiguousarray(stretch, float).ravel()
        values = _over(NUMBERS[self.name], flat, np.array(self.constants))
        return values.reshape(3, *np.shape(stretch))

    def stress(self, stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nominal stress P [MPa] and its derivative by stretch, shapes as given."""
        _, stress, slope = self._points(stretch)
        return stress, slope

    def energy(self, stretch: np.ndarray) -> np.ndarray:
        """Work of the nominal stress from 1 to `stretch` [MJ/m3]."""
        return self._points(stretch)[0]


def law_of(name: str, constants: Sequence[float] = ()) -> Law:
    """A law with constants of its own as far as they are given, and ours beyond."""
    ours = () if name == "ogden" and constants else LAWS[name][len(constants) :]
    return Law(name, (*constants, *ours))


TRELOAR = law_of("ogden")
