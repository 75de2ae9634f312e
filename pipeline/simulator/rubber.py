"""The law `rubber` beside the neo-Hookean one, as in rubber.h: what its parameters mean.

`mooney_share` m and `upturn` c are the shape of the relaxed curve (Biderman 1958, to the second
order: Mooney's two terms and the square of the first invariant), `softening` s what a band loses
up to the largest stretch that it has seen (Mullins; Ogden and Roxburgh, 10.1098/rspa.1999.0431).

`relaxation` is what rubber relaxes in each decade of time, about evenly (Ferry, Viscoelastic
Properties of Polymers, 1980, ch. 1; latex over 24 h: docs/real.md). Eight branches carry it, evenly
in log time from 3 ms to 10^4 s. What is faster is damping. Young's modulus is the one that is left
after LATER: nobody waits for the slow branches, which in a rollout of some seconds are springs.
"""

from __future__ import annotations

import numpy as np

from pipeline.params.identification import LAWS

NEO_HOOKEAN, RUBBER = LAWS
TIMES = np.geomspace(0.003, 1e4, 8)  # of the branches [s]
DECADES = np.log10(TIMES[1] / TIMES[0])  # from one to the next
LATER = 10.0  # s after a sudden stretch
JOIN = 0.05  # as in rubber.h


def memories(law: str) -> int:
    """Numbers that each edge remembers: branches, and three that the steps keep beside them."""
    return len(TIMES) + 3 if law == RUBBER else 0


def relaxed(relaxation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share of Young's modulus that never relaxes, and a branch's, at a relaxation (...)."""
    weight = DECADES * np.asarray(relaxation, float)
    return 1 - weight * np.exp(-LATER / TIMES).sum(), weight


def update(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What branches keep of their overstress over steps of h (...) [s], and take of p's change.

    Exact where p is linear within the step; shapes (..., 8).
    """
    part = np.asarray(h, float)[..., None] / TIMES
    return np.exp(-part), -np.expm1(-part) / part


def uniaxial(
    stretch: np.ndarray, share: np.ndarray | float, upturn: np.ndarray | float = 0.0
) -> np.ndarray:
    """Virgin nominal stress over the shear modulus, stretches >= 1."""
    first = stretch**2 + 2 / stretch - 3
    return (stretch - stretch**-2) * (1 - share + share / stretch + upturn * first)


def work(
    stretch: np.ndarray, share: np.ndarray | float, upturn: np.ndarray | float = 0.0
) -> np.ndarray:
    """Work of `uniaxial` from rest, stretches >= 1."""
    first, second = stretch**2 + 2 / stretch - 3, 2 * stretch + stretch**-2 - 3
    return (first + share * (second - first)) / 2 + upturn * first**2 / 4


def softened(work: np.ndarray, worst: np.ndarray, softening: np.ndarray | float) -> np.ndarray:
    """Share of the virgin stress that is left at a work, after the largest `worst`, >= 0 both."""
    gap = np.maximum(1 - work / np.maximum(worst, 1e-30), 0)
    return 1 - (2 + JOIN) * softening * gap**2 / (gap**2 + gap + JOIN)


def overstress(stress: np.ndarray, step: float) -> np.ndarray:
    """What the branches carry after a history of p (..., T) at equal steps that starts relaxed.

    Returns:
        Shape (..., 8), in the unit of p; times a branch's share it adds to the stress.
    """
    forget, follow = update(np.array(step))
    result = np.zeros((*stress.shape[:-1], len(TIMES)))
    for change in np.moveaxis(np.diff(stress, axis=-1), -1, 0):
        result = forget * result + follow * change[..., None]
    return result
