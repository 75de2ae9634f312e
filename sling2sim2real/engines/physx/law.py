"""The law of PhysX's deformable volumes, as its public source has it.

softBodyGM.cu of PhysX 5.6 (tetrahedronsSolveGM, the model eCO_ROTATIONAL, which USD cannot change)
holds two constraints in each tetrahedron, |F - R| = 0 and J = 1, with compliances 1 / (2 mu V) and
1 / (lam V). Their energy is

    W = mu |F - R|^2 + lam/2 (J - 1)^2,    P = 2 mu (F - R) + lam (J - 1) cof F

with Lame's own mu and lam, and R the rotation in F. It is stiffer than the neo-Hookean law when
stretched: per E, 1.27 times at twice the length. elasticityDamping is a time in seconds.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.exporting.mesh import Tube


def lame(young, poisson) -> tuple:
    """Return mu and lam [Pa]."""
    return young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))


def stress(gradient: np.ndarray, young, poisson) -> np.ndarray:
    """Nominal stress P [Pa] at deformation gradients (..., 3, 3); the moduli fit (...)."""
    mu, lam = (np.asarray(modulus)[..., None, None] for modulus in lame(young, poisson))
    off, volume, cofactor = _strain(gradient)
    return 2 * mu * off + lam * (volume - 1) * cofactor


def force_on(tube: Tube, sections: list[int], positions: np.ndarray, young, poisson) -> np.ndarray:
    """Force of bands on what holds some of their sections [N].

    Args:
        positions: Of bands, shape (..., sections, V, 3).
        young, poisson: One a band or one for all; fit (...).

    Returns:
        Shape (..., 3).
    """
    held = np.zeros(tube.rest.shape[:2], bool)
    held[sections] = True
    near = tube.tetrahedra[held.ravel()[tube.tetrahedra].any(axis=1)]
    before, gradient = _gradients(tube, near, positions)
    inverse = np.linalg.inv(before)
    moduli = [np.asarray(modulus)[..., None] for modulus in (young, poisson)]
    nominal = stress(gradient, *moduli)
    shares = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    retained = shares * held.ravel()[near][..., None]
    return -np.einsum("t,...tij,tkj->...i", np.linalg.det(before) / 6, nominal, retained)


def _strain(gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """F - R (..., 3, 3), J (..., 1, 1) and cof F (..., 3, 3); not a number where F is none."""
    sound = np.isfinite(gradient).all(axis=(-2, -1), keepdims=True)
    left, _, right = np.linalg.svd(np.where(sound, gradient, np.eye(3)))  # it raises on NaN
    left[..., 2] *= np.linalg.det(left @ right)[..., None]  # a rotation, no reflection
    first, second, third = (gradient[..., i] for i in range(3))
    cofactor = np.stack(
        [np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=-1
    )
    return gradient - left @ right, np.linalg.det(gradient)[..., None, None], cofactor


def _gradients(tube: Tube, near: np.ndarray, positions: np.ndarray) -> tuple:
    """Edges at rest (T, 3, 3) of tetrahedra `near` (T, 4), and their gradients (..., T, 3, 3)."""
    before, now = (
        np.swapaxes(corners[..., 1:, :] - corners[..., :1, :], -1, -2)
        for corners in (
            vertices.reshape(*vertices.shape[:-3], -1, 3)[..., near, :]
            for vertices in (tube.rest, positions)
        )
    )
    return before, now @ np.linalg.inv(before)
