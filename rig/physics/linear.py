"""Solves (1 - gamma J) z = r for a band's Jacobian J: the preconditioner of CVODE's GMRES.

The solve is exact, so that GMRES needs about one iteration. With places x, velocities v and
memories m the rates are x' = v, v' = A x + B v + C m and m' = D x + E m: block elimination leaves
the velocities alone,

    x = r_x + gamma v,   m = (1 - gamma E)^-1 (r_m + gamma D x),
    (1 - gamma (B + gamma A + gamma C W)) v = r_v + gamma (A r_x + C m(v = 0)),
    W = gamma (1 - gamma E)^-1 D.

A memory belongs to an edge and follows its stretch, so E is triangular and D has two nodes to an
edge. What is left is banded, of three velocities a node, and is factorised as L U without pivots.
"""

from __future__ import annotations

import numpy as np

from rig.physics.compiled import compiled
from rig.physics.forces import NEAR, slopes

REACH = 3 * NEAR + 2  # to each side of the diagonal


class Elimination:
    """`setup` and `solve` as scikit-sundae's preconditioner has them, of states (nodes, 6 + M)."""

    def __init__(self, nodes: int, width: int) -> None:
        self.jacobian = np.zeros((nodes, 2 * NEAR + 1, width, width))
        self.memories = np.zeros((nodes, 2, width - 6, 3))
        self.factors = np.empty((3 * nodes, 2 * REACH + 1))
        self.gamma = 0.0

    def setup(self, time, y, rates, reuse, new, gamma, data) -> None:
        """Factorise for this gamma; `reuse`: with the Jacobian of before."""
        if not reuse:
            slopes(time, y, self.jacobian, data)
        new[0], self.gamma = not reuse, gamma
        _factorised(self.jacobian, gamma, self.memories, self.factors)

    def solve(self, time, y, rates, r, z, gamma, delta, side, data) -> None:
        """Write z."""
        _solved(self.jacobian, self.gamma, self.memories, self.factors, r, z)


@compiled
def _forgotten(jacobian: np.ndarray, e: int, gamma: float, w: np.ndarray) -> None:
    """Solve for the memories of edge e in place: each depends on itself and on later ones alone."""
    size = len(w)
    for k in range(size - 1, -1, -1):
        for other in range(k + 1, size):
            w[k] += gamma * jacobian[e, NEAR, 6 + k, 6 + other] * w[other]
        w[k] /= 1 - gamma * jacobian[e, NEAR, 6 + k, 6 + k]


@compiled
def _factorised(
    jacobian: np.ndarray, gamma: float, memories: np.ndarray, factors: np.ndarray
) -> None:
    """Write d(memory)/dx of each edge's two nodes, and the LU factors of what is left."""
    nodes, width = len(jacobian), jacobian.shape[2]
    w = np.empty(width - 6)
    for e in range(nodes - 1):
        for n in range(2):
            for c in range(3):
                w[:] = gamma * jacobian[e, NEAR + n, 6:, c]
                _forgotten(jacobian, e, gamma, w)
                memories[e, n, :, c] = w
    factors[:] = 0.0
    for i in range(nodes):
        for a in range(3):
            factors[3 * i + a, REACH] = 1.0
        if i == 0 or i == nodes - 1:
            continue
        for j in range(max(i - NEAR, 1), min(i + NEAR + 1, nodes - 1)):
            block = jacobian[i, j - i + NEAR]
            for a in range(3):
                for c in range(3):
                    value = gamma * block[3 + a, c] + block[3 + a, 3 + c]
                    for e in range(max(i - 1, j - 1), min(i, j) + 1):
                        for k in range(width - 6):
                            entry = jacobian[i, e - i + NEAR, 3 + a, 6 + k]
                            value += gamma * entry * memories[e, j - e, k, c]
                    factors[3 * i + a, REACH + 3 * (j - i) + c - a] -= gamma * value
    for p in range(3 * nodes):
        for q in range(p + 1, min(p + REACH + 1, 3 * nodes)):
            factors[q, REACH + p - q] /= factors[p, REACH]
            part = factors[q, REACH + p - q]
            for c in range(1, REACH + 1):
                factors[q, REACH + p - q + c] -= part * factors[p, REACH + c]


@compiled
def _solved(
    jacobian: np.ndarray,
    gamma: float,
    memories: np.ndarray,
    factors: np.ndarray,
    r: np.ndarray,
    z: np.ndarray,
) -> None:
    """Write z."""
    nodes, width = len(jacobian), jacobian.shape[2]
    size = 3 * nodes
    right, given, solution = np.empty(size), r.reshape((nodes, width)), z.reshape((nodes, width))
    solution[:] = given
    for e in range(nodes - 1):  # the memories if no node had another velocity
        for k in range(width - 6):
            for n in range(2):
                for c in range(3):
                    solution[e, 6 + k] += gamma * jacobian[e, NEAR + n, 6 + k, c] * given[e + n, c]
        _forgotten(jacobian, e, gamma, solution[e, 6:])
    for i in range(nodes):
        for a in range(3):
            value = 0.0
            if 0 < i < nodes - 1:
                for j in range(max(i - NEAR, 0), min(i + NEAR + 1, nodes)):
                    for c in range(3):
                        value += jacobian[i, j - i + NEAR, 3 + a, c] * given[j, c]
                for e in range(i - 1, i + 1):
                    for k in range(width - 6):
                        value += jacobian[i, e - i + NEAR, 3 + a, 6 + k] * solution[e, 6 + k]
            right[3 * i + a] = given[i, 3 + a] + gamma * value
    for p in range(size):
        for q in range(max(p - REACH, 0), p):
            right[p] -= factors[p, REACH + q - p] * right[q]
    for p in range(size - 1, -1, -1):
        for q in range(p + 1, min(p + REACH + 1, size)):
            right[p] -= factors[p, REACH + q - p] * right[q]
        right[p] /= factors[p, REACH]
    for i in range(1, nodes - 1):
        for c in range(3):
            solution[i, 3 + c] = right[3 * i + c]
            solution[i, c] += gamma * right[3 * i + c]
    for e in range(nodes - 1):
        for n in range(2):
            if 0 < e + n < nodes - 1:
                for k in range(width - 6):
                    for c in range(3):
                        solution[e, 6 + k] += gamma * memories[e, n, k, c] * right[3 * (e + n) + c]
