"""The rig's rubber: an elastic law and what it remembers.

Nominal stress at stretch l, with P the elastic law's (elasticity.py):

    sigma = Q + sum_k g_k (Q - w_k) + s P(l/f)/f + eta Q' dl/dt,   Q = h P(l)

w_k' = (Q - w_k)/tau_k: quasi-linear relaxation. Branch k carries g_k Q at once and forgets it over
    tau_k; eta stands for what is faster.
f = exp(e), e' = r(P(l/f), f): a second network that flows (`Flow`, Bergström and Boyce).
h(W, W_max): softening by the largest energy so far (`Softening`, Mullins' effect); the second
    network does not soften.

Memories are the w_k, then e, then W_max, as far as the rubber has them: M of each edge.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import erf

from rig.physics import elasticity
from rig.physics.compiled import compiled
from rig.physics.elasticity import TRELOAR, Law
from rig.physics.integration import integrated

FOREVER = 1e9  # s


def spectrum(weight: float, times: tuple[float, float], branches: int, slope: float) -> np.ndarray:
    """Branches of a box (slope 0: as much in every decade) or of a wedge, tau^-slope.

    Names of Tobolsky, Properties and Structure of Polymers, 1960, which we could not open.

    Args:
        weight: Sum over the branches.
        times: The shortest and the longest [s], the ends of the first and the last branch's part.

    Returns:
        (branches, 2) pairs of weight and time [s], times in the middle of equal parts of ln(tau).
    """
    ends = np.geomspace(*times, branches + 1)
    middles = np.sqrt(ends[1:] * ends[:-1])
    weights = middles**-slope
    return np.stack([weight * weights / weights.sum(), middles], axis=1)


@dataclass(frozen=True)
class Flow:
    """The flowing network of Bergström and Boyce, J. Mech. Phys. Solids 46 (1998) 931.

    e' = rate (c - 1 + offset)^chain (|sigma|/E)^power in the direction of sigma, the network's true
    stress a share; c is the stretch of a chain by the flow, c^2 = (f^2 + 2/f)/3. We could not open
    the paper: the form is that of Altair's manual (MATVE, BBOYCE), whose example has power 5, chain
    -0.7, offset 0.01; E, Young's modulus of the law, makes `rate` one of time alone.

    Attributes:
        share: s, of this network's stress to the first one's at the same elastic stretch.
        rate: [1/s].
        power, chain, offset: Dimensionless; chain <= 0.
    """

    share: float
    rate: float
    power: float
    chain: float
    offset: float


@compiled
def flow_speed(stress: float, strain: float, flow: np.ndarray) -> float:
    """e' [1/s] of a true stress a share, over E, and flowed strain e; `flow` as in `Flow`."""
    rate, power, chain, offset = flow[1], flow[2], flow[3], flow[4]
    f = np.exp(strain)
    eased = np.sqrt((f**2 + 2 / f) / 3) - 1 + offset
    return rate * eased**chain * np.sign(stress) * np.abs(stress) ** power


@dataclass(frozen=True)
class Softening:
    """Mullins' effect, in two forms; h is 1 while the law's energy W is the largest so far.

    By energy, Ogden and Roxburgh, Proc. R. Soc. Lond. A 455 (1999) 2861, written from memory:
        h = 1 - erf((W_max - W)/(energy E + growth W_max))/damage
    By strain, an exponential as in Zuniga and Beatty, ZAMP 53 (2002) 794, but towards an end:
        h = 1 - (1 - exp((x - x_max)/energy))/damage,    x = sqrt(2 W/E)
    We could open neither paper. W_max follows W within `lag`, so that its rate is continuous.

    Attributes:
        damage: r >= 1, the less the softer.
        energy: m over E, Young's modulus of the law; by strain, a strain.
        growth: beta, by energy alone.
        lag: [s].
        strain: 1 by strain, 0 by energy.
    """

    damage: float
    energy: float
    growth: float
    lag: float = 1e-3
    strain: float = 0.0

    def stored(self, energy: np.ndarray, worst: np.ndarray, modulus: float) -> np.ndarray:
        """The integral of h from 0 to `energy` [MJ/m3]: what an unloading gives back."""
        if self.strain:
            m, most = self.energy, np.sqrt(2 * np.maximum(worst, 0.0) / modulus)
            x = np.minimum(np.sqrt(2 * np.maximum(energy, 0.0) / modulus), most)
            back = m * np.exp(-most / m) * (x * np.exp(x / m) - m * np.expm1(x / m))
            return energy - modulus * (x**2 / 2 - back) / self.damage
        width = self.energy * modulus + self.growth * worst
        part = lambda x: x * erf(x) + np.exp(-(x**2)) / np.sqrt(np.pi)  # noqa: E731
        below = np.minimum(energy, worst)
        lost = width * (part(worst / width) - part((worst - below) / width)) / self.damage
        return energy - lost


@compiled
def softened(energy: float, worst: float, modulus: float, softening: np.ndarray) -> float:
    """h of an energy and the largest so far [MJ/m3]; `softening` as in `Softening`."""
    if softening[4]:
        least = max(min(energy, worst), 0.0)  # at rest, rounding can make an energy negative
        short = math.sqrt(2 * max(worst, 0.0) / modulus) - math.sqrt(2 * least / modulus)
        return 1 + math.expm1(-short / softening[1]) / softening[0]
    width = softening[1] * modulus + softening[2] * worst
    return 1 - math.erf(max(worst - energy, 0.0) / width) / softening[0]


class Material(NamedTuple):
    """What compiled code reads of a `Rubber`; arrays are empty where it has no such part."""

    law: int
    constants: np.ndarray
    modulus: float
    weights: np.ndarray
    times: np.ndarray
    flow: np.ndarray
    softening: np.ndarray


@compiled
def respond(
    i: int, stretch: float, memory: np.ndarray, rates: np.ndarray, material: Material
) -> tuple[float, float]:
    """Stress without viscosity [MPa] and the slope Q' of its elastic part at a stretch.

    Reads row i of the memories (N, M) and writes that of their rates.
    """
    branches = len(material.times)
    energy, stress, slope = elasticity.at(material.law, stretch, material.constants)
    if len(material.softening):
        worst = memory[i, -1]
        part = softened(energy, worst, material.modulus, material.softening)
        stress, slope = part * stress, part * slope
        rates[i, -1] = max(energy - worst, 0.0) / material.softening[3]
    total = stress
    for k in range(branches):
        owed = stress - memory[i, k]
        total += material.weights[k] * owed
        rates[i, k] = owed / material.times[k]
    if len(material.flow):
        strain = memory[i, branches]
        f = np.exp(strain)
        flowing = elasticity.at(material.law, stretch / f, material.constants)[1]
        total += material.flow[0] * flowing / f
        true = flowing * stretch / f / material.modulus
        rates[i, branches] = flow_speed(true, strain, material.flow)
    return total, slope


@compiled
def _responses(
    stretch: np.ndarray, memory: np.ndarray, material: Material
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`respond` at N places."""
    total, slope, rates = np.empty(len(stretch)), np.empty(len(stretch)), np.empty(memory.shape)
    for i in range(len(stretch)):
        total[i], slope[i] = respond(i, stretch[i], memory, rates, material)
    return total, slope, rates


@compiled
def _flowing(time: float, strain: np.ndarray, rate: np.ndarray, data: tuple) -> None:
    """e' where the stretch is the cubic of coefficients (4, T - 1) between equal steps."""
    coefficients, step, material = data
    leg = min(int(time / step), coefficients.shape[1] - 1)
    since, stretch = time - leg * step, 0.0
    for coefficient in coefficients[:, leg]:
        stretch = stretch * since + coefficient
    elastic = stretch / np.exp(strain[0])
    stress = elasticity.at(material.law, elastic, material.constants)[1]
    rate[0] = flow_speed(stress * elastic / material.modulus, strain[0], material.flow)


@dataclass(frozen=True)
class Rubber:
    """One band's material.

    Attributes:
        scale: Factor on the law [Pa per MPa].
        relaxation: (K, 2) pairs of weight g_k and time tau_k [s].
        viscosity: eta [s].
        law: P.
        flow, softening: None: it has none.
    """

    scale: float
    relaxation: np.ndarray
    viscosity: float
    law: Law = TRELOAR
    flow: Flow | None = None
    softening: Softening | None = None

    @property
    def weights(self) -> np.ndarray:
        return self.relaxation[:, 0]

    @property
    def times(self) -> np.ndarray:
        return self.relaxation[:, 1]

    @property
    def memories(self) -> int:
        """M."""
        return len(self.times) + (self.flow is not None) + (self.softening is not None)

    @cached_property
    def material(self) -> Material:
        part = lambda section: np.empty(0) if section is None else np.array(astuple(section), float)  # noqa: E731
        return Material(
            elasticity.NUMBERS[self.law.name],
            np.array(self.law.constants, float),
            self.law.modulus,
            np.array(self.weights, float),
            np.array(self.times, float),
            part(self.flow),
            part(self.softening),
        )

    def response(
        self, stretch: np.ndarray, memory: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stress without viscosity [MPa], the slope Q' of its elastic part, rates of the memories.

        Args:
            stretch, memory: Shapes (N,) and (N, M).
        """
        return _responses(np.asarray(stretch, float), np.asarray(memory, float), self.material)

    def _kept(self, energy: np.ndarray, worst: np.ndarray) -> np.ndarray:
        """h of energies and the largest so far (N,)."""
        numbers, modulus = self.material.softening, self.law.modulus
        return np.array(
            [softened(e, w, modulus, numbers) for e, w in zip(energy, worst, strict=True)]
        )

    def remembering(self, stretch: np.ndarray, ratios: np.ndarray) -> np.ndarray:
        """Memories (N, M) at stretches (N,).

        Args:
            ratios: To those of rubber that was held there for ever, w_k / Q, e / ln(l) and
                W_max / W, shape (M,).
        """
        stress, branches = self.law.stress(stretch)[0], len(self.times)
        more = [] if self.flow is None else [ratios[branches] * np.log(stretch)]
        if self.softening is not None:
            energy = self.law.energy(stretch)
            worst = ratios[-1] * energy
            stress = stress * self._kept(energy, worst)
            more.append(worst)
        return np.stack([*(ratio * stress for ratio in ratios[:branches]), *more], axis=1)

    def history(
        self, stretch: np.ndarray, step: float, worst: float = 1.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Memories along a history (T,) of equal steps [s] that starts relaxed.

        w_k is exact for a Q that is linear within each step.

        Args:
            worst: Stretch to which the rubber was pulled before.

        Returns:
            Those of rubber that was held for ever at each stretch, and what is remembered: (T, M).
        """
        stress = self.law.stress(stretch)[0]
        held, remembered = [], []
        if self.flow is not None:
            held.append(np.log(stretch))
            remembered.append(self._flowed(stretch, step))
        if self.softening is not None:
            energy = self.law.energy(stretch)
            before = self.law.energy(worst)  # pyright: ignore[reportArgumentType]
            most = np.maximum.accumulate(np.maximum(energy, before))
            stress = stress * self._kept(energy, most)
            held.append(energy)
            remembered.append(most)
        decay = np.exp(-step / self.times)
        mean = self.times / step * (1 - decay)
        memory = np.empty((len(stress), len(self.times)))
        memory[0] = stress[0]
        for i in range(1, len(stress)):
            start, end = stress[i - 1], stress[i]
            memory[i] = decay * memory[i - 1] + (mean - decay) * start + (1 - mean) * end
        relaxed = np.repeat(stress[:, None], len(self.times), axis=1)
        return np.column_stack([relaxed, *held]), np.column_stack([memory, *remembered])

    def _flowed(self, stretch: np.ndarray, step: float) -> np.ndarray:
        """e along a history (T,) of equal steps [s]."""
        times = step * np.arange(len(stretch))
        path = np.ascontiguousarray(PchipInterpolator(times, stretch).c)
        data, start = (path, step, self.material), np.log(stretch[:1])
        return integrated(_flowing, start, times, data, 1e-7, 1e-9, max_step=step)[1][:, 0]

    def frozen(self, ratios: np.ndarray | None) -> tuple[Rubber, np.ndarray]:
        """This rubber while no memory changes, and the ratios of its own memories.

        Args:
            ratios: (M,), see `remembering`; None: all is relaxed and virgin.
        """
        if ratios is None:
            elastic = replace(self, relaxation=np.array([[0.0, FOREVER]]))
            return replace(elastic, flow=None, softening=None), np.zeros(1)
        branches = len(self.times)
        excess = float(self.weights @ (1 - ratios[:branches]))
        stopped = replace(
            self,
            relaxation=np.array([[excess, FOREVER]]),
            flow=self.flow and replace(self.flow, rate=0.0),
            softening=self.softening and replace(self.softening, lag=FOREVER),
        )
        return stopped, np.append(0.0, ratios[branches:])

    def stored(self, stretch: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """Energy density of (N,), (N, M) over `scale`, but for the w_k's [MJ/m3]."""
        energy = self.law.energy(stretch)
        if self.softening is not None:
            energy = self.softening.stored(energy, memory[:, -1], self.law.modulus)
        if self.flow is not None:
            elastic = stretch / np.exp(memory[:, len(self.times)])
            energy = energy + self.flow.share * self.law.energy(elastic)
        return energy
