"""The law `rubber` beside the neo-Hookean one: Mooney's share and relaxation, as in rubber.h.

Relaxation is one weight: eight branches at half decades from 3 ms to 10 s carry it evenly, because
rubber relaxes about as much in every decade (Ferry, Viscoelastic Properties of Polymers, 1980, ch.
1). Young's modulus is the relaxed one; at once a band is 1 + 8 `relaxation` times as stiff. What is
faster than 3 ms is damping.
"""

from __future__ import annotations

import numpy as np

from pipeline.params.identification import LAWS

NEO_HOOKEAN, RUBBER = LAWS
TIMES = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0])  # of the branches [s]


def memories(law: str) -> int:
    """Numbers that each edge remembers: branches, and two that the steps keep beside them."""
    return len(TIMES) + 2 if law == RUBBER else 0


def update(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What branches keep of their overstress over steps of h (...) [s], and take of p's change.

    Exact where p is linear within the step; shapes (..., 8).
    """
    part = np.asarray(h, float)[..., None] / TIMES
    return np.exp(-part), -np.expm1(-part) / part


def uniaxial(stretch: np.ndarray, share: np.ndarray | float) -> np.ndarray:
    """Relaxed nominal stress over the shear modulus (Mooney 1940, Rivlin 1948), stretches >= 1."""
    return (stretch - stretch**-2) * (1 - share + share / stretch)


def overstress(stress: np.ndarray, step: float) -> np.ndarray:
    """What the branches carry after a history of p (..., T) at equal steps that starts relaxed.

    Returns:
        Shape (..., 8), in the unit of p; times `relaxation` it adds to the stress.
    """
    forget, follow = update(np.array(step))
    result = np.zeros((*stress.shape[:-1], len(TIMES)))
    for change in np.moveaxis(np.diff(stress, axis=-1), -1, 0):
        result = forget * result + follow * change[..., None]
    return result
