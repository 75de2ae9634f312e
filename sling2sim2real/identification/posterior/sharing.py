"""How much each of several recordings counts for what they share: an error of the law.

Instruments err anew in each recording: those are its nuisances, and more recordings average them.
What a law gets wrong of a band it gets wrong in all of them, by nobody knows how much alike. So
their residuals may not count as independent. Split covariance intersection (Julier and Uhlmann,
General decentralized data fusion with covariance intersection, 2001) is sure whatever they share:
residuals of recording k count with a share w_k, all shares add up to 1, its nuisances' priors stay
whole. The shares are those by which all recordings together tell most: never less than any alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import LinearConstraint, minimize

from sling2sim2real.identification.posterior.expansion import Expansion

LEAST_SHARE = 1e-3
RIDGE = 1e-9  # of a coordinate's information, where nothing tells it


def shares(expansions: Sequence[Expansion], precision: np.ndarray) -> np.ndarray:
    """Shares of N recordings, shape (N,), by which the density's Gaussian is narrowest (D-optimal).

    Args:
        precision: Of the coordinates' priors, shape (D,).
    """
    count = len(expansions)
    even = np.full(count, 1 / count)
    if count == 1:
        return even

    def together(shares: np.ndarray) -> np.ndarray:
        told = (it.told(share) for it, share in zip(expansions, shares, strict=True))
        return sum(told, np.diag(precision))

    ridge = RIDGE * np.diag(np.diag(together(even)))
    found = minimize(
        lambda shares: -np.linalg.slogdet(together(shares) + ridge)[1],
        even,
        method="SLSQP",
        bounds=[(LEAST_SHARE, 1.0)] * count,
        constraints=LinearConstraint(np.ones(count), 1.0, 1.0),
        options={"ftol": 1e-6},
    )
    return found.x / found.x.sum()
