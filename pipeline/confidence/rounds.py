"""One round of Gauss-Newton: simulate a design, fit the surrogate, weigh the residuals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pipeline.base.errors import UserError
from pipeline.confidence.axes import Axes
from pipeline.confidence.ensemble import sample
from pipeline.confidence.residuals import Residuals
from pipeline.confidence.surrogate import Surrogate, monomials
from pipeline.confidence.whitening import weights
from pipeline.episode.episode import Episode
from pipeline.sling.interaction import Rollouts, interact
from pipeline.sling.theta import at_points

LANES = 16  # rollouts that cost as much as one
REACH = 3.0  # of the surrogate, in spreads of its design
WALKERS = 100
FAST = 0.25  # s after the release in which a stamp's jitter moves the picture
STAR = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])  # release and camera of the batches, in steps


class NoConfidence(UserError):
    """Too few simulations around θ* succeed to tell how sure it is."""


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of what the recording leaves open.

    Attributes:
        release, camera: Of the release and of the camera's clock against the force's [s].
        jitter: Of one picture's stamp [s].
        shift, turn: Of the camera's extrinsics [m], [rad].
        bias: Of the tared force [N].
    """

    release: float = 3e-4
    camera: float = 1e-3
    jitter: float = 1e-4
    shift: float = 1e-3
    turn: float = 1.7e-3
    bias: float = 0.02

    @classmethod
    def of(cls, episode: Episode) -> Tolerances:
        """From an episode's metadata, or as usual where it says nothing."""
        about = episode.metadata.get("preprocessing", {})
        delays = about.get("delays") or {}
        camera, pose = ((delays.get(name) or {}).get("error") for name in ("camera", "pose"))
        camera = None if camera is None else np.hypot(camera, pose or 0.0)
        given = {"release": about.get("release_error"), "camera": camera}
        return cls(**{name: float(value) for name, value in given.items() if value})


@dataclass(frozen=True)
class Place:
    """Where a surrogate is expanded.

    Attributes:
        even: Coordinates of the parameters, shape (D,).
        factor: Of their spread: even + factor z, shape (D, D).
        times: Shift of the release and of the pictures [s], shape (2,).
        steps: Of the two [s], shape (2,).
    """

    even: np.ndarray
    factor: np.ndarray
    times: np.ndarray
    steps: np.ndarray

    def coordinates(self, z: np.ndarray) -> np.ndarray:
        """Even coordinates (N, D) of standardised ones."""
        return self.even + z @ self.factor.T

    def standardised(self, even: np.ndarray) -> np.ndarray:
        """The inverse of `coordinates`."""
        return np.linalg.solve(self.factor, (even - self.even).T).T


@dataclass(frozen=True)
class Round:
    """A surrogate with its weights, and what it rests on.

    Attributes:
        misfit: -2 log of likelihood and priors, the box's left out, of standardised points (N, D).
        log_density: Of the posterior at such points; -inf outside the box and the surrogate.
        weight: Of each squared residual, shape (R,).
        groups: What the weights rest on, as `whitening.weights` says it.
        hold: Coefficients of the log of the held force.
        design: The standardised rollouts, shape (N, D).
        failed: How many others failed.
    """

    place: Place
    surrogate: Surrogate
    residuals: Residuals
    misfit: Callable[[np.ndarray], np.ndarray]
    log_density: Callable[[np.ndarray], np.ndarray]
    weight: np.ndarray
    groups: list[dict]
    hold: np.ndarray
    design: np.ndarray
    failed: int

    def hold_force(self, z: np.ndarray) -> np.ndarray:
        """Force of the drawn band on the hand before the release [N], (N,)."""
        return np.exp(_linear(z) @ self.hold)

    def starts(self, rng: np.random.Generator) -> np.ndarray:
        """Walkers around the best of the design, where the density is not 0, (WALKERS, D)."""
        around = np.concatenate([np.zeros((1, self.design.shape[1])), self.design])
        return _walkers(self.log_density, around, rng)


class Rounds:
    """What every round of an episode's posterior needs."""

    def __init__(
        self,
        episode: Episode,
        sling,
        cutoff: float,
        axes: Axes,
        tolerances: Tolerances,
        pool,
    ) -> None:
        """`pool` maps over batches; for the rest see `posterior.fit`."""
        self.episode, self.sling, self.cutoff, self.axes = episode, sling, cutoff, axes
        self.tolerances, self.pool = tolerances, pool
        self.rollouts = 0
        self._most: np.ndarray | None = None

    def simulate(self, theta: np.ndarray, times: np.ndarray) -> list[Rollouts]:
        """Batches of LANES physical theta (N, P); each has its times (N / LANES, 2)."""

        def batch(theta: np.ndarray, shift: np.ndarray) -> Rollouts:
            shifted = replace(
                self.episode,
                release_time=self.episode.release_time + shift[0],
                cloud_time=self.episode.cloud_time + shift[1],
            )
            sling, theta = at_points(self.sling, theta)
            return interact(sling, shifted, theta)

        self.rollouts += len(theta)
        return list(self.pool.map(batch, np.split(theta, len(times)), times))

    def run(self, place: Place, even: np.ndarray, heat: float) -> Round:
        """Simulate coordinates (N, D), N a multiple of LANES, and fit the surrogate to them.

        Args:
            heat: Weights are divided by it.

        Raises:
            NoConfidence: Too many of the simulations fail.
        """
        star = STAR[np.arange(len(even) // LANES) % len(STAR)]
        rollouts = self.simulate(self.axes.physical(even), place.times + star * place.steps)
        z = place.standardised(even)
        good = np.concatenate([[why is None for why in one.failure] for one in rollouts])
        if good.sum() < 2 * monomials(z).shape[1]:
            raise NoConfidence(
                f"episode of {self.episode.band}: {(~good).sum()} of {len(good)} simulations near"
                " the best parameters fail; how sure they are cannot be told"
            )
        nearest = np.argmin(np.where(good, np.linalg.norm(z, axis=1), np.inf))
        reference = rollouts[nearest // LANES].center_line[nearest % LANES]
        residuals = Residuals(self.episode, self.sling, self.cutoff, reference)
        vectors = np.concatenate(list(self.pool.map(residuals, rollouts)))
        good &= np.isfinite(vectors).all(axis=1)
        hold = residuals.hold_force(vectors[good])
        z, shifted = z[good], np.repeat(star, LANES, axis=0)[good]
        surrogate = self._surrogate(place, residuals, z, shifted, vectors[good])
        misfit, density = self._density(place, surrogate, z)
        weight, groups = self._weigh(surrogate, residuals, density, z, heat)
        return Round(
            place=place,
            surrogate=surrogate,
            residuals=residuals,
            misfit=misfit,
            log_density=density,
            weight=weight,
            groups=groups,
            hold=np.linalg.lstsq(_linear(z), np.log(hold), rcond=1e-10)[0],
            design=z,
            failed=int((~good).sum()),
        )

    def _surrogate(self, place, residuals, z, shifted, vectors) -> Surrogate:
        has, known = self.tolerances, residuals.columns()
        sizes = {"force_bias": has.bias, "cloud_shift": has.shift, "cloud_turn": has.turn}
        columns = [sizes[name[:-2]] * column for name, column in known.items()]
        plain = Surrogate(z, shifted, vectors, np.zeros((0, residuals.size)))
        camera = plain.coefficients[plain.terms + 1] / place.steps[1]
        after = self.episode.cloud_time - self.episode.release_time
        for frame in np.flatnonzero((after > 0) & (after < FAST)):
            columns.append(has.jitter * np.where(residuals.of_frame(frame), camera, 0.0))
        columns += list(plain.left)
        own = np.array([has.release, has.camera])
        ones, zeros = np.ones(len(columns)), np.zeros(len(columns))
        return Surrogate(
            z,
            shifted,
            vectors,
            np.array(columns),
            precision=np.concatenate([(place.steps / own) ** 2, ones]),
            centre=np.concatenate([-place.times / place.steps, zeros]),
        )

    def _density(self, place, surrogate, design):
        reach = REACH * max(1.0, np.abs(design).max() / 3)
        box = self.axes

        def misfit(z: np.ndarray) -> np.ndarray:
            theta = box.physical(place.coordinates(z))
            return surrogate.misfit(z) - 2 * box.space.log_prior(theta)

        def log_density(z: np.ndarray) -> np.ndarray:
            theta = box.physical(place.coordinates(z))
            inside = box.inside(theta) & (np.abs(z).max(axis=1) < reach)
            prior = box.log_volume(theta) + box.space.log_prior(theta)
            return np.where(inside, prior - surrogate.misfit(z) / 2, -np.inf)

        return misfit, log_density

    def _weigh(self, surrogate, residuals, density, design, heat):
        """Weights by the residuals at the optimum, which depends on the weights."""
        groups = residuals.groups
        best, rng = np.zeros((1, design.shape[1])), np.random.default_rng(0)
        residual = surrogate.coefficients[0]

        def spread(weight: np.ndarray) -> np.ndarray:
            full = np.zeros(residuals.size)
            for group, one in zip(groups, weight, strict=True):
                full[group.rows] = one
            return full

        if self._most is None:  # at θ*, with the nuisances at their best
            surrogate.weigh(spread(weights(groups, residual)[0]))
            residual = surrogate.residual(best[0])
            self._most = np.array([np.mean(residual[group.rows] ** 2) for group in groups])
        for _ in range(4):
            weight, table = weights(groups, residual, self._most)
            full = spread(weight / heat)
            surrogate.weigh(full)
            start = _walkers(density, np.concatenate([best, design]), rng)
            drawn = sample(density, start, steps=40, keep=5, rng=rng).reshape(-1, len(best[0]))
            best = drawn[[np.argmax(density(drawn))]]
            residual = surrogate.residual(best[0])
        return full, table


def _linear(z: np.ndarray) -> np.ndarray:
    return np.concatenate([np.ones((len(z), 1)), z], axis=1)


def _walkers(density, around: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Walkers near the densest of some points (N, D), each where the density is not 0."""
    centre = around[np.argmax(density(around))]
    walkers = np.tile(centre, (WALKERS, 1))
    scale, left = 0.3, np.arange(WALKERS)
    while len(left) and scale > 1e-6:
        trial = centre + scale * rng.normal(size=(len(left), len(centre)))
        good = np.isfinite(density(trial))
        walkers[left[good]] = trial[good]
        left, scale = left[~good], 0.8 * scale
    return walkers
