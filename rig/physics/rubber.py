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

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.special import erf

from rig.physics.elasticity import TRELOAR, Law

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

    def speed(self, stress: np.ndarray, strain: np.ndarray) -> np.ndarray:
        """e' [1/s] of true stresses a share, over E, and flowed strains e."""
        f = np.exp(strain)
        eased = np.sqrt((f**2 + 2 / f) / 3) - 1 + self.offset
        return self.rate * eased**self.chain * np.sign(stress) * np.abs(stress) ** self.power


@dataclass(frozen=True)
class Softening:
    """Mullins' effect by Ogden and Roxburgh, Proc. R. Soc. Lond. A 455 (1999) 2861.

    h = 1 - erf((W_max - W)/(energy E + growth W_max))/damage, with W the law's energy: 1 while W is
    the largest so far. We could not open the paper: the formula is written from memory. W_max
    follows W within `lag`, so that its rate is continuous.

    Attributes:
        damage: r >= 1, the less the softer.
        energy: m over E, Young's modulus of the law.
        growth: beta.
        lag: [s].
    """

    damage: float
    energy: float
    growth: float
    lag: float = 1e-3

    def kept(self, energy: np.ndarray, worst: np.ndarray, modulus: float) -> np.ndarray:
        """h of energies and the largest so far, over the law's `modulus` E; all [MJ/m3]."""
        width = self.energy * modulus + self.growth * worst
        return 1 - erf(np.maximum(worst - energy, 0) / width) / self.damage

    def stored(self, energy: np.ndarray, worst: np.ndarray, modulus: float) -> np.ndarray:
        """The integral of h from 0 to `energy` [MJ/m3]: what an unloading gives back."""
        width = self.energy * modulus + self.growth * worst
        part = lambda x: x * erf(x) + np.exp(-(x**2)) / np.sqrt(np.pi)  # noqa: E731
        below = np.minimum(energy, worst)
        lost = width * (part(worst / width) - part((worst - below) / width)) / self.damage
        return energy - lost


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

    def response(
        self, stretch: np.ndarray, memory: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stress without viscosity [MPa], the slope Q' of its elastic part, rates of the memories.

        Args:
            stretch, memory: Shapes (N, ...) and (N, M, ...).
        """
        stress, slope = self.law.stress(stretch)
        more = []
        if self.softening is not None:
            energy, worst = self.law.energy(stretch), memory[:, -1]
            kept = self.softening.kept(energy, worst, self.law.modulus)
            stress, slope = kept * stress, kept * slope
            more.append(np.maximum(energy - worst, 0) / self.softening.lag)
        branches = len(self.times)
        owed = stress[:, None] - memory[:, :branches]
        total = stress + np.einsum("k,ik...->i...", self.weights, owed)
        rates = owed / self.times.reshape(-1, *(1,) * (stretch.ndim - 1))
        if self.flow is not None:
            strain = memory[:, branches]
            f = np.exp(strain)
            flowing = self.law.stress(stretch / f)[0]
            total = total + self.flow.share * flowing / f
            more.insert(0, self.flow.speed(flowing * stretch / f / self.law.modulus, strain))
        if more:
            rates = np.concatenate([rates, np.stack(more, axis=1)], axis=1)
        return total, slope, rates

    def remembering(self, stretch: np.ndarray, ratios: np.ndarray) -> np.ndarray:
        """Memories (N, M, ...) at stretches (N, ...).

        Args:
            ratios: To those of rubber that was held there for ever, w_k / Q, e / ln(l) and
                W_max / W, shape (M,).
        """
        stress, branches = self.law.stress(stretch)[0], len(self.times)
        more = [] if self.flow is None else [ratios[branches] * np.log(stretch)]
        if self.softening is not None:
            energy = self.law.energy(stretch)
            worst = ratios[-1] * energy
            stress = stress * self.softening.kept(energy, worst, self.law.modulus)
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
        held, found = [], []
        if self.flow is not None:
            held.append(np.log(stretch))
            found.append(self._flowed(self.flow, stretch, step))
        if self.softening is not None:
            energy = self.law.energy(stretch)
            before = self.law.energy(worst)  # pyright: ignore[reportArgumentType]
            most = np.maximum.accumulate(np.maximum(energy, before))
            stress = stress * self.softening.kept(energy, most, self.law.modulus)
            held.append(energy)
            found.append(most)
        decay = np.exp(-step / self.times)
        mean = self.times / step * (1 - decay)
        memory = np.empty((len(stress), len(self.times)))
        memory[0] = stress[0]
        for i in range(1, len(stress)):
            start, end = stress[i - 1], stress[i]
            memory[i] = decay * memory[i - 1] + (mean - decay) * start + (1 - mean) * end
        relaxed = np.repeat(stress[:, None], len(self.times), axis=1)
        return np.column_stack([relaxed, *held]), np.column_stack([memory, *found])

    def _flowed(self, flow: Flow, stretch: np.ndarray, step: float) -> np.ndarray:
        """e along a history (T,) of equal steps [s]."""
        times = step * np.arange(len(stretch))
        path = PchipInterpolator(times, stretch)

        def rate(time: float, strain: np.ndarray) -> np.ndarray:
            elastic = path(time) / np.exp(strain)
            stress = self.law.stress(elastic)[0] * elastic / self.law.modulus
            return flow.speed(stress, strain)

        start, span = [np.log(stretch[0])], (times[0], times[-1])
        solved = solve_ivp(rate, span, start, "LSODA", times, max_step=step, rtol=1e-7, atol=1e-9)
        return solved.y[0]

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
