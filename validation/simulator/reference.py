"""The rod of sling2sim2real/simulator/rod.h in plain NumPy, float64, written a second time.

A state x has shape (..., L, 9): per section the node and the directors a, b of the edge behind it.
The columns of the deformation gradients, F = [g a b], and the differences of neighbouring frames
are linear in x; everything else is algebra on them. Leading axes are a batch. Nothing here is fast:
tests and `sling verify` hold rod.h against it, and measure energies with it.

A step keeps some coefficients at the predicted state, as rod.h does: those of the viscous forces,
and the twist of a joint, which is linear about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sling2sim2real.simulator.initial import fixed_frames
from sling2sim2real.simulator.material import material
from sling2sim2real.simulator.model import GRAVITY, ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import (
    BRANCH_TIMES_S,
    COROTATED,
    RUBBER,
    SOFTENING_JOIN,
    relaxed,
)

TURNS = 1e-2  # of the modulus: keeps the spin of an unstressed edge regular
HOLDS, TAUT = (
    1e-4,
    1.2,
)  # s d that brakes turns of a slack edge [s]; the stretch from which it is taut
FLOW_POWER = 3  # of |o/E|, by which its rate grows
STRAIGHT = 0.7  # stretch below which the law `rubber` is a straight line


def cofactor(f: np.ndarray) -> np.ndarray:
    """Gradient of det [f0 f1 f2] by each column, shape (..., 3, 3); columns lie in axis -2."""
    return np.cross(np.roll(f, -1, axis=-2), np.roll(f, -2, axis=-2))


def cofactor_rate(f: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Second derivative of det at f, applied to `rate`: the quadratic cofactor, polarised."""
    return cofactor(f + rate) - cofactor(f) - cofactor(rate)


def _spin(pair: np.ndarray) -> np.ndarray:
    """(a, b) -> (b, -a): 2 tau = (a+, b+) . spin(a-, b-)."""
    return np.stack([pair[..., 1, :], -pair[..., 0, :]], axis=-2)


def _lost(gap: np.ndarray | float) -> np.ndarray:
    """Integral from 0 of what softening takes away at a gap, of softening 1."""
    root = np.sqrt(1 - 4 * SOFTENING_JOIN)
    a, b = (1 + root) / 2, (1 - root) / 2
    logs = (
        (a - SOFTENING_JOIN) * np.log1p(gap / a) - (b - SOFTENING_JOIN) * np.log1p(gap / b)
    ) / root
    return (2 + SOFTENING_JOIN) * (gap - logs)


def _sum(product: np.ndarray) -> np.ndarray:
    return product.sum(axis=(-2, -1))


@dataclass(frozen=True)
class ReferenceRod:
    """One band with one theta.

    Attributes:
        theta: One sample.
        gravity: Along -z [m/s^2].
        payload: Mass at the middle node [kg].
        gripped: The fingers hold the direction of the middle.
        share: Of the bending and twisting stiffness; guesses relax with less first.
        carried, following: Of the law `rubber` in a step: stress [Pa] that its branches add
            whatever the step's end is, shape (E,), and what they add of p there.
        worst: Of the law `rubber`: largest work that an edge has seen [Pa], shape (E,).
    """

    sling: ClampedBand
    theta: Parameters
    gravity: float = GRAVITY
    payload: float = 0.0
    gripped: bool = False
    share: float = 1.0
    carried: np.ndarray | float = 0.0
    following: float = 0.0
    worst: np.ndarray | float = 0.0

    @cached_property
    def parameters(self) -> tuple[float, ...]:
        """mu, lam, d, s of state.h."""
        return material(self.sling, self.theta)[0].tolist()[:4]

    @cached_property
    def _values(self) -> dict[str, float]:
        return self.theta.sample()

    def value(self, name: str) -> float:
        """Value of a parameter; 0 where the law has none."""
        return self._values.get(name, 0.0)

    @cached_property
    def branches(self) -> np.ndarray:
        """Weight of each over what never relaxes, shape (9,): those that relax, and what flows."""
        left, weight = relaxed(self.value("relaxation"))
        return np.append(np.full(len(BRANCH_TIMES_S), weight), self.value("flow")) / left

    def fading(self, overstress: np.ndarray) -> np.ndarray:
        """Rates at which branches forget an overstress (..., E, 9) [Pa], the same shape [1/s]."""
        strain = np.abs(overstress[..., -1:]) / (3 * self.parameters[0])
        flow = 10 ** self.value("log_flow_rate") * strain**FLOW_POWER
        times = np.broadcast_to(1 / BRANCH_TIMES_S, (*overstress.shape[:-1], len(BRANCH_TIMES_S)))
        return np.concatenate([times, flow], axis=-1)

    def update(self, step: np.void, overstress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What branches keep of their overstress (E, 9) [Pa] over a step, and take of p's change.

        Returns:
            Shapes (E, 9) and (9,).
        """
        flow = 1 / (1 + step["h"] * self.fading(overstress)[:, -1:])
        forget = np.broadcast_to(step["forget"], (len(flow), len(BRANCH_TIMES_S)))
        return np.hstack([forget, flow]), np.append(step["follow"], 1.0)

    # ---- edges

    def columns(self, x: np.ndarray) -> np.ndarray:
        """g, a, b of each edge, shape (..., E, 3, 3)."""
        g = np.diff(x[..., :3], axis=-2) / self.sling.edge_lengths[:, None]
        return np.stack([g, x[..., :-1, 3:6], x[..., :-1, 6:9]], axis=-2)

    def _to_sections(self, stress: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """Forces on sections from those on columns (..., E, 3, 3) and edge directors."""
        force = np.zeros((*stress.shape[:-3], self.sling.sections, 9), stress.dtype)
        force[..., :-1, :3] -= stress[..., 0, :]
        force[..., 1:, :3] += stress[..., 0, :]
        volume = self.sling.edge_lengths[:, None, None]
        force[..., :-1, 3:] += (volume * stress[..., 1:, :] + pairs).reshape(*stress.shape[:-2], 6)
        return force

    def stress(self, x: np.ndarray) -> np.ndarray:
        """Nominal stress times the area, by column [N]: A (mu F + p cof F)."""
        mu, lam, _, _ = self.parameters
        f = self.columns(x)
        cof = cofactor(f)
        p = lam * ((f[..., 0, :] * cof[..., 0, :]).sum(-1) - 1) - mu
        stress = mu * f + p[..., None, None] * cof
        if self.sling.law == RUBBER:
            stretch = self.stretch(f)
            virgin = self.uniaxial(stretch)
            pull = self.softened(stretch) * virgin - self.uniaxial(stretch, shape=(0.0, 0.0))
            pull = pull + self.carried + self.following * virgin
            stress[..., 0, :] += (pull / stretch)[..., None] * f[..., 0, :]
        if self.sling.law == COROTATED:
            stretch = self.stretch(f)
            pull = self.corotated(stretch) - self.uniaxial(stretch, shape=(0.0, 0.0))
            stress[..., 0, :] += (pull / stretch)[..., None] * f[..., 0, :]
        return self.sling.area * stress

    def corotated(self, stretch: np.ndarray, order: int = 0) -> np.ndarray:
        """As `uniaxial`, of the law `corotated`: of an edge that keeps its volume."""
        mu = 2 * self.parameters[0]
        at = np.where(np.real(stretch) > STRAIGHT, stretch, STRAIGHT)
        past = stretch - at
        work = at**2 / 2 - at + 1 / at - 2 / np.sqrt(at) + 1.5
        stress, slope = at - 1 - at**-2 + at**-1.5, 1 + 2 * at**-3 - 1.5 * at**-2.5
        both = work + stress * past + slope * past**2 / 2, stress + slope * past, slope
        return mu * both[order + 1]

    # ---- the law `rubber`: an edge's stretch, and the stress along it

    def stretch(self, columns: np.ndarray) -> np.ndarray:
        return np.sqrt((columns[..., 0, :] ** 2).sum(-1))

    def uniaxial(self, stretch: np.ndarray, order: int = 0, shape=None) -> np.ndarray:
        """Virgin nominal stress [Pa], its slope (order 1), or its work from rest (order -1).

        Biderman's of `shape`, Mooney's share and the upturn; below STRAIGHT it goes on straight.
        """
        mu = self.parameters[0]
        share, upturn = shape or (self.value("mooney_share"), self.value("upturn"))
        at = np.where(np.real(stretch) > STRAIGHT, stretch, STRAIGHT)
        past, first = stretch - at, at**2 + 2 / at - 3
        factor = 1 - share + share / at + upturn * first
        stress = (at - at**-2) * factor
        turn = -share / at**2 + 2 * upturn * (at - at**-2)
        slope = (1 + 2 * at**-3) * factor + (at - at**-2) * turn
        work = (1 - share) * first / 2 + share * (at + at**-2 / 2 - 1.5) + upturn * first**2 / 4
        both = work + stress * past + slope * past**2 / 2, stress + slope * past, slope
        return mu * both[order + 1]

    def pulled(self, stretch: np.ndarray) -> np.ndarray:
        """Work [Pa] by which softening goes: of a stretch from rest, 0 in compression."""
        return np.where(np.real(stretch) > 1, self.uniaxial(stretch, -1), 0.0)

    def softened(self, stretch: np.ndarray) -> np.ndarray:
        """Share of the virgin stress that is left."""
        done = self.pulled(stretch)
        gap = 1 - done / np.where(self.worst > 0, self.worst, 1.0)
        gap = np.where((np.real(gap) > 0) & (self.worst > 0) & (np.real(stretch) > 1), gap, 0.0)
        return 1 - (2 + SOFTENING_JOIN) * self.value("softening") * gap**2 / (
            gap**2 + gap + SOFTENING_JOIN
        )

    def stored(self, stretch: np.ndarray) -> np.ndarray:
        """Free energy [Pa] of the softened stress: its integral at the largest work so far."""
        done = self.pulled(stretch)
        worst = np.maximum(self.worst, done)
        gap = 1 - done / np.where(worst > 0, worst, 1.0)
        lost = worst * (_lost(1.0) - _lost(gap))
        return self.uniaxial(stretch, -1) - self.value("softening") * lost

    def lost_for_ever(self, grown: np.ndarray) -> np.ndarray:
        """Energy [J] lost where the largest work of edges grows by `grown` (..., E) [Pa]."""
        volume = self.sling.area * self.sling.edge_lengths
        return _lost(1.0) * self.value("softening") * (grown * volume).sum(-1)

    def stretch_at(self, stress: np.ndarray) -> np.ndarray:
        """Where the relaxed stress is `stress` [Pa], by bisection: it grows with the stretch."""
        low, high = np.full_like(stress, -50.0), np.full_like(stress, 50.0)
        for _ in range(80):
            middle = (low + high) / 2
            above = self.uniaxial(middle) > stress
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return (low + high) / 2

    def remembered(self, overstress: np.ndarray, columns: np.ndarray) -> tuple[float, float]:
        """Free energy [J] of branches with overstress (..., E, 9), and the power they lose [W]."""
        stretch = self.stretch(columns)[..., None]
        stress = self.uniaxial(stretch)
        retained = stress - overstress
        q = self.stretch_at(retained)
        free = self.uniaxial(stretch, -1) - self.uniaxial(q, -1) - retained * (stretch - q)
        lost = overstress * (stretch - q) * self.fading(overstress)
        volume = self.sling.area * self.sling.edge_lengths
        return tuple((density @ self.branches * volume).sum(-1) for density in (free, lost))

    def viscous_stress(self, rate: np.ndarray, at: np.ndarray) -> np.ndarray:
        """d times the rate of the nominal stress at state `at`, shape part scaled by s, times A.

        In the frame in which it dissipates least, but for the share of turns that is braked.
        """
        mu, lam, d, s = self.parameters
        f, turn = self.columns(at), self.columns(rate)
        cof = cofactor(f)
        volume_rate = _sum(cof * turn)[..., None, None]
        # Gershgorin's bound on the largest principal stretch; less in compression
        longest = np.abs(np.einsum("...kc,...lc->...kl", f, f)).sum(-1).max(-1)
        bound = mu / np.sqrt(np.maximum(longest, 1e-6))
        j = (f[..., 0, :] * cof[..., 0, :]).sum(-1)
        least = -bound * (1 + np.clip(j, 0, 1) ** 2) / 2
        p = np.clip(lam * (j - 1) - mu, least, 0.7 * bound)
        holds = min(HOLDS / max(d * s, 1e-30), 1)
        holds = holds * np.clip((TAUT - self.stretch(f)) / (TAUT - 1), 0, 1)
        braked = np.maximum(self.value("turn_damping"), np.where(j > 0, holds, 1))
        if self.sling.law == RUBBER:  # as the relaxed stress grows against the neo-Hookean
            stretch = np.maximum(self.stretch(f), STRAIGHT)
            s = s * (self.uniaxial(stretch, 1) / self.uniaxial(stretch, 1, shape=(0.0, 0.0)))
            s = s[..., None, None]
        if self.sling.law == COROTATED:
            stretch = np.maximum(self.stretch(f), STRAIGHT)
            s = s * (self.corotated(stretch, 1) / self.uniaxial(stretch, 1, shape=(0.0, 0.0)))
            s = s[..., None, None]
        p = p[..., None, None]
        stress = mu * f + p * cof
        spin = ((1 - braked)[..., None] * self._spin(f, stress, turn, mu))[..., None, :]
        shape = mu * turn + p * cofactor_rate(f, turn) + mu / 3 * volume_rate * cof
        shape = shape - np.cross(spin, stress)
        return self.sling.area * d * ((lam - mu / 3) * volume_rate * cof + s * shape)

    @staticmethod
    def _spin(f: np.ndarray, stress: np.ndarray, rate: np.ndarray, mu) -> np.ndarray:
        """Spin of the frame of least dissipation by `rate`, (..., E, 3); columns lie in axis -2."""
        tau = np.einsum("...km,...kn->...mn", f, stress)
        tau = (tau + np.swapaxes(tau, -1, -2)) / 2
        trace = np.trace(tau, axis1=-2, axis2=-1) + TURNS * np.squeeze(mu)
        inertia = trace[..., None, None] * np.eye(3) - tau
        moment = np.cross(stress, rate).sum(axis=-2)
        return np.linalg.solve(inertia, moment[..., None])[..., 0]

    # ---- joints: between neighbouring frames; one that does not move has no length

    @cached_property
    def _fixed(self) -> np.ndarray:
        return fixed_frames(self.sling)

    def _frames(self, x: np.ndarray, fixed: float) -> np.ndarray:
        """Pairs a, b along the band, those of clamps (and fingers) times `fixed` among them."""
        pairs = x[..., :-1, 3:].reshape(*x.shape[:-2], self.sling.edges, 2, 3)
        first, last, fingers = fixed * self._fixed
        middle = self.sling.middle
        hand = [np.broadcast_to(fingers, (*x.shape[:-2], 1, 2, 3))] if self.gripped else []
        ends = [np.broadcast_to(end, (*x.shape[:-2], 1, 2, 3)) for end in (first, last)]
        return np.concatenate(
            [ends[0], pairs[..., :middle, :, :], *hand, pairs[..., middle:, :, :], ends[1]], axis=-3
        )

    @cached_property
    def _stiffness(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness of each joint in bending and in twist [N m], shape (joints,)."""
        sling, middle = self.sling, self.sling.middle
        sizes = [0.0, *sling.edge_lengths[:middle], *([0.0] if self.gripped else [])]
        sizes = np.array([*sizes, *sling.edge_lengths[middle:], 0.0])
        per_length = self.share * sling.area * self.parameters[0] * 2 / (sizes[1:] + sizes[:-1])
        per_length[[0, -1]] *= sling.clamped
        bending = material(sling, self.theta)["bending"]
        return bending * per_length, sling.radius**2 / 4 * per_length

    def _joint_forces(self, x, rate, at, bounded: bool) -> np.ndarray:
        """Forces on the directors of edges, shape (..., E, 2, 3), the twist linear about `at`."""
        _, _, d, s = self.parameters
        bend, torsion = self._stiffness
        near, moving, turn = (self._frames(at, 1), self._frames(x, 1), self._frames(rate, 0))
        after, before = _spin(near[..., :-1, :, :]) / 2, -_spin(near[..., 1:, :, :]) / 2
        twist = _sum(after * moving[..., 1:, :, :] + before * moving[..., :-1, :, :])
        twist = twist - _sum(after * near[..., 1:, :, :])
        loss = 2 * (bend - torsion)
        if bounded:  # so that neither energy nor dissipation of a joint is negative
            size = _sum(after**2 + before**2)
            loss = np.minimum(loss, 1.9 * bend / np.maximum(size, 1e-3))
        pull = bend[:, None, None] * np.diff(moving + d * s * turn, axis=-3)
        twist = (loss * twist)[..., None, None]
        on_after, on_before = pull - twist * after, -pull - twist * before
        force = on_after[..., :-1, :, :] + on_before[..., 1:, :, :]
        if self.gripped:  # the frame between the two edges in the middle is the fingers'
            force = np.delete(force, self.sling.middle, axis=-3)
        return force

    # ---- energies and forces

    def elastic(self, x: np.ndarray) -> np.ndarray:
        """Stored energy [J], shape (...)."""
        mu, lam, _, _ = self.parameters
        f = self.columns(x)
        j = np.linalg.det(f)
        density = mu / 2 * (_sum(f**2) - 3) - mu * (j - 1) + lam / 2 * (j - 1) ** 2
        if self.sling.law == RUBBER:
            stretch = self.stretch(f)
            density += self.stored(stretch) - self.uniaxial(stretch, -1, shape=(0.0, 0.0))
        if self.sling.law == COROTATED:
            stretch = self.stretch(f)
            density += self.corotated(stretch, -1) - self.uniaxial(stretch, -1, shape=(0.0, 0.0))
        edges = (density * self.sling.area * self.sling.edge_lengths).sum(-1)
        bend, torsion = self._stiffness
        frames = self._frames(x, 1)
        twist = _sum(frames[..., 1:, :, :] * _spin(frames[..., :-1, :, :])) / 2
        joints = bend * _sum(np.diff(frames, axis=-3) ** 2) - 2 * (bend - torsion) * twist**2
        return edges + joints.sum(-1) / 2

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Gradient of the stored energy, shape (..., L, 9)."""
        return self._to_sections(
            self.stress(x), self._joint_forces(x, np.zeros_like(x), x, bounded=False)
        )

    def internal(self, x: np.ndarray, rate: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Elastic and viscous forces of a step: the latter at, the twist about the state `at`."""
        return self._to_sections(
            self.stress(x) + self.viscous_stress(rate, at),
            self._joint_forces(x, rate, at, bounded=True),
        )

    def viscous(self, rate: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Viscous forces alone; `rate` times them is the dissipated power [W]."""
        return self.internal(at, rate, at) - self.internal(at, np.zeros_like(rate), at)

    @cached_property
    def mass(self) -> np.ndarray:
        """Inertia of each degree of freedom, shape (L, 9): halves of edges, and directors."""
        sling, ds = self.sling, self.sling.edge_lengths
        line = sling.mass / sling.rest_length
        mass = np.zeros((sling.sections, 9))
        mass[:, :3] = line * (np.append(ds, 0) + np.append(0, ds))[:, None] / 2
        mass[:, 3:] = line * np.append(ds, ds[-1])[:, None] * sling.radius**2 / 4
        mass[sling.middle, :3] += self.payload
        return mass

    def kinetic(self, v: np.ndarray) -> np.ndarray:
        moving = v.copy()
        moving[..., -1, 3:] = 0  # no edge of its own
        return (self.mass * moving**2).sum(axis=(-2, -1)) / 2

    def weight(self, x: np.ndarray) -> np.ndarray:
        """Energy in gravity [J]."""
        return self.gravity * (self.mass[:, 2] * x[..., 2]).sum(-1)
