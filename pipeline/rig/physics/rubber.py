"""The rig's rubber: Ogden's law in the shape of Treloar's vulcanised rubber, with relaxation.

Nominal stress at stretch l (incompressible): P(l) = sum_i mu_i (l^(a_i - 1) - l^(-a_i/2 - 1))
Quasi-linear viscoelasticity: sigma = P + sum_k g_k (P - w_k) + eta dP/dt, w_k' = (P - w_k)/tau_k
so that branch k carries g_k P at once and forgets it over tau_k; eta stands for what is faster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Fitted to the uniaxial points of Treloar, Trans. Faraday Soc. 40 (1944) 59 (relative errors, RMS
# 1.7 %), with his equibiaxial points, read as uniaxial compression, at a tenth of the weight: the
# tests of this folder repeat the fit. mu_i a_i > 0 makes P grow with l everywhere.
MODULI = np.array([4.38677e-02, 1.91199e-10, -5.25868])  # MPa, an overall factor is each band's own
EXPONENTS = np.array([3.153406, 12.467417, -0.134005])

_POWERS = np.concatenate([EXPONENTS - 1, -EXPONENTS / 2 - 1])
_FACTORS = np.concatenate([MODULI, -MODULI])
_TABLE = np.stack([_FACTORS, _FACTORS * _POWERS])  # (2, 6): of P and of l dP/dl
UNIT_MODULUS = float(_TABLE[1].sum())  # dP/dl at l = 1, MPa


def nominal_stress(stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Treloar's rubber [MPa]: nominal stress and its derivative by stretch, shapes as given."""
    powers = np.exp(np.multiply.outer(_POWERS, np.log(stretch)))
    stress, slope = np.tensordot(_TABLE, powers, axes=1)
    return stress, slope / stretch


def energy_density(stretch: np.ndarray) -> np.ndarray:
    """Work of the nominal stress from 1 to `stretch` [MJ/m3]."""
    mode = lambda a: (stretch**a - 1) / a + 2 * (stretch ** (-a / 2) - 1) / a  # noqa: E731
    return sum(m * mode(a) for m, a in zip(MODULI, EXPONENTS, strict=True))


@dataclass(frozen=True)
class Rubber:
    """One band's material.

    Attributes:
        scale: Factor on Treloar's rubber [Pa per MPa].
        relaxation: (K, 2) pairs of weight g_k and time tau_k [s].
        viscosity: eta [s].
    """

    scale: float
    relaxation: np.ndarray
    viscosity: float

    @property
    def weights(self) -> np.ndarray:
        return self.relaxation[:, 0]

    @property
    def times(self) -> np.ndarray:
        return self.relaxation[:, 1]

    def memory(self, stretch: np.ndarray, step: float) -> np.ndarray:
        """w_k along a stretch history (T,) of equal steps that starts relaxed, shape (T, K), MPa.

        Exact for a stress that is linear within each step.
        """
        stress = nominal_stress(stretch)[0]
        decay = np.exp(-step / self.times)
        mean = self.times / step * (1 - decay)
        memory = np.empty((len(stress), len(self.times)))
        memory[0] = stress[0]
        for i in range(1, len(stress)):
            start, end = stress[i - 1], stress[i]
            memory[i] = decay * memory[i - 1] + (mean - decay) * start + (1 - mean) * end
        return memory
