"""The law `rubber` beside the neo-Hookean one, as in rubber.h: what its parameters mean.

`mooney_share` m and `upturn` c are the shape of the relaxed curve (Biderman 1958, to the second
order: Mooney's two terms and the square of the first invariant), `softening` s what a band loses
up to the largest stretch that it has seen (Mullins; Ogden and Roxburgh, 10.1098/rspa.1999.0431).

`relaxation` is what rubber relaxes in each decade of time, about evenly (Ferry, Viscoelastic
Properties of Polymers, 1980, ch. 1; latex over 24 h: docs/real.md). Eight branches carry it, evenly
in log time from 3 ms to 10^4 s. What is faster is damping. Young's modulus is the one that is left
after MODULUS_AFTER_S: nobody waits for the slow branches, which are springs in a rollout.

`flow` is the share of that modulus with which a further branch pulls, whose overstress o flows by
its fourth power (Bergstrom and Boyce 1998, 10.1016/S0022-5096(97)00075-6): o' = p' - r |o/E|^3 o, r
being 10 to the power of `log_flow_rate` [1/s]. It stands for the work that slow cycles lose at
whatever speed.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.settings.identification import LAWS

NEO_HOOKEAN, RUBBER, COROTATED = LAWS
BRANCH_TIMES_S = np.geomspace(0.003, 1e4, 8)  # of the branches [s]
DECADES_A_BRANCH = np.log10(BRANCH_TIMES_S[1] / BRANCH_TIMES_S[0])  # from one to the next
MODULUS_AFTER_S = 10.0  # s after a sudden stretch
SOFTENING_JOIN = 0.05  # as in rubber.h
FLOW_POWER = 3  # of |o/E|, by which the rate grows; as in rubber.h


def memories(law: str) -> int:
    """Numbers that each edge remembers: of the branches, flow, and three that steps keep beside."""
    return len(BRANCH_TIMES_S) + 1 + 3 if law == RUBBER else 0


def relaxed(relaxation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share of Young's modulus that never relaxes, and a branch's, at a relaxation (...)."""
    weight = DECADES_A_BRANCH * np.asarray(relaxation, float)
    return 1 - weight * np.exp(-MODULUS_AFTER_S / BRANCH_TIMES_S).sum(), weight


def update(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What branches keep of their overstress over steps of h (...) [s], and take of p's change.

    Exact where p is linear within the step; shapes (..., 8).
    """
    part = np.asarray(h, float)[..., None] / BRANCH_TIMES_S
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
    return 1 - (2 + SOFTENING_JOIN) * softening * gap**2 / (gap**2 + gap + SOFTENING_JOIN)


def overstress(stress: np.ndarray, step: float) -> np.ndarray:
    """What the branches carry after a history of p (..., T) at equal steps that starts relaxed.

    Returns:
        Shape (..., 8), in the unit of p; times a branch's share it adds to the stress.
    """
    forget, follow = update(np.array(step))
    result = np.zeros((*stress.shape[:-1], len(BRANCH_TIMES_S)))
    for change in np.moveaxis(np.diff(stress, axis=-1), -1, 0):
        result = forget * result + follow * change[..., None]
    return result


def flowing(stress: np.ndarray, step: float, pause: float, rate: np.ndarray | float) -> np.ndarray:
    """What the flowing branch carries after a history that starts relaxed, and a pause.

    Args:
        stress: p over the shear modulus, at equal steps, shape (..., T).
        step, pause: [s].
        rate: Of the flow [1/s], one or one a history (...).

    Returns:
        Shape (...), over the shear modulus; times `flow` it adds to the stress.
    """
    result = np.zeros(stress.shape[:-1])
    for change in np.moveaxis(np.diff(stress, axis=-1), -1, 0):
        result = flowed(result, step, rate) + change
    return flowed(result, pause, rate)


def flowed(overstress: np.ndarray, time: float, rate: np.ndarray | float) -> np.ndarray:
    """What is left of an overstress, over the shear modulus, that flows for a time [s]: exactly."""
    passed = FLOW_POWER * time * rate * np.abs(overstress / 3) ** FLOW_POWER
    return overstress * (1 + passed) ** (-1 / FLOW_POWER)
