"""The posterior of θ: iterated Gauss-Newton on a quadratic surrogate, then samples in the box.

Each round simulates a design around the present mean, spread as the present posterior; fits the
surrogate; weighs the residuals by what they are at its optimum; and samples the new posterior. The
first rounds are heated, and none is much narrower than the one before: the misfit has other minima
where swing or friction go astray, and a design that shrinks too soon ends in one. Where data do not
tell a parameter, the design reaches from face to face of the box.

Times are nuisances that must be simulated: batches of rollouts share a shifted release, or shifted
pictures. Other nuisances act linearly on the measured side and need no rollouts.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, qmc

from pipeline.confidence.axes import DAMPING, SCALE, Axes
from pipeline.confidence.ensemble import sample
from pipeline.confidence.rounds import LANES, Place, Round, Rounds, Tolerances
from pipeline.episode.episode import Episode

START = {  # spread of the first design, even coordinates
    "youngs_modulus": 0.04,
    "poissons_ratio": 0.03,
    "elasticity_damping": 0.4,
    "dynamic_friction": 0.4,
    "damping_scale": 0.25,
    "mooney_share": 0.1,
    "relaxation": 0.01,
    "air_drag": 1.0,
}
SPREAD = 1.25  # of a design against the posterior
SHRINK, GROW = 0.3, 2.0  # of a design's spread against the one before
HEAT = (100.0, 30.0, 9.0, 2.7)  # of the first rounds
ROUNDS = 11  # at most
STILL = 0.7  # standard deviations that the mean may move before the last round
SETTLED = 1.0  # and in it, if its intervals are to be relied on
BATCHES, LAST = 5, 10  # of a round and of the last one, at least
MORE = 2.5  # rollouts for each term of the surrogate, at least: a few may fail
SHORT, LONG = 180, 900  # steps of the sampler in a round and in the last one
DRAWS = 4000  # that intervals are quantiles of


@dataclass(frozen=True)
class Posterior:
    """What is known of θ.

    Attributes:
        samples: Physical, shape (M, P): the axes of the method's box.
        mean: Of the even coordinates, as physical parameters, shape (P,).
        derived: Samples of what data see better than θ, shape (M,) each: damping_product [s],
            hold_force [N], release_time [s], camera_delay [s], and air_drag [1/s] where it is free.
        rounds, last: What the rounds needed, and the last one, on whose surrogate all this rests.
        moved: How far the mean moved in it, in standard deviations.
        course: Physical mean after each round, shape (rounds, P).
    """

    samples: np.ndarray
    mean: np.ndarray
    derived: dict[str, np.ndarray]
    rounds: Rounds
    last: Round
    moved: float
    course: np.ndarray

    @property
    def settled(self) -> bool:
        """Whether its intervals are to be relied on."""
        return self.moved <= SETTLED


def fit(
    episode: Episode,
    sling,
    cutoff: float,
    axes: Axes,
    theta: np.ndarray,
    *,
    tolerances: Tolerances | None = None,
    seed: int = 1,
    workers: int | None = None,
) -> Posterior:
    """Posterior of an episode's θ, and of the air's drag where it is one of the axes.

    Args:
        cutoff: Of the low-pass that the recorded force went through [Hz].
        theta: Where to begin, shape (P,): the best that a search found.
        tolerances: Of the instruments; by default what the episode's metadata say.
        workers: Threads; they change no result.
    """
    rng = np.random.default_rng(seed)
    tolerances = tolerances or Tolerances.of(episode)
    even = axes.clipped(axes.even(np.atleast_2d(theta)))[0]
    factor = np.diag([START[name] for name in axes.names])
    times, steps = np.zeros(2), np.array([tolerances.release, tolerances.camera])
    course = []
    with ThreadPoolExecutor(workers) as pool:
        rounds = Rounds(episode, sling, cutoff, axes, tolerances, pool)
        moved, last = np.inf, False
        while not last:
            number = len(course)
            last = number == ROUNDS - 1 or moved < STILL
            heat = HEAT[number] if number < len(HEAT) else 1.0
            place = Place(even, SPREAD * factor, times, steps)
            z = _design(len(even), batches(len(even), last) * LANES, seed + number)
            design = axes.clipped(place.coordinates(z))
            design[0] = even
            found = rounds.run(place, design, heat)
            drawn = draw(found, rng, LONG if last else SHORT)
            flat = place.coordinates(drawn)
            mean = axes.clipped(flat.mean(axis=0)[None])[0]
            covariance = np.atleast_2d(np.cov(flat, rowvar=False))
            step = mean - even
            moved = _distance(step, covariance) if heat == 1.0 else np.inf
            course.append(axes.physical(mean[None])[0])
            even, factor = mean, _followed(factor, covariance + np.outer(step, step))
            best, certain = found.surrogate.nuisances(place.standardised(mean[None]))
            times = place.times + best[0, :2] * place.steps
            sure = np.sqrt(np.diag(certain)[:2]) * place.steps
            steps = np.clip(2 * sure, SHRINK * steps, steps)
    theta = axes.physical(flat)
    drag = {"air_drag": theta[:, -1]} if axes.space.names[-1] == "air_drag" else {}
    return Posterior(
        samples=theta,
        mean=course[-1],
        derived=_derived(found, drawn, theta, episode, rng) | drag,
        last=found,
        moved=moved,
        rounds=rounds,
        course=np.array(course),
    )


def batches(dimension: int, last: bool) -> int:
    """How many batches of LANES rollouts a round simulates: enough for its surrogate."""
    terms = (dimension + 1) * (dimension + 2) // 2
    return max(LAST if last else BATCHES, -(-int(MORE * terms) // LANES))


def draw(found: Round, rng: np.random.Generator, steps: int) -> np.ndarray:
    """Standardised samples of a round's posterior, shape (DRAWS, D)."""
    start = found.starts(rng)
    drawn = sample(found.log_density, start, steps=steps, keep=steps // 3, rng=rng)
    drawn = drawn.reshape(-1, drawn.shape[-1])
    return drawn[rng.choice(len(drawn), DRAWS, replace=False)]


def _design(dimension: int, count: int, seed: int) -> np.ndarray:
    """A Latin hypercube of normal deviates, shape (count, dimension)."""
    return norm.ppf(qmc.LatinHypercube(dimension, rng=np.random.default_rng(seed)).random(count))


def _distance(step: np.ndarray, covariance: np.ndarray) -> float:
    """Length of a step in standard deviations, root mean square of the axes."""
    return float(np.sqrt(step @ np.linalg.solve(covariance, step) / len(step)))


def _followed(factor: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Factor (D, D) of the next design: of `covariance`, within bounds of the one before."""
    inner = np.linalg.solve(factor, np.linalg.solve(factor, covariance).T)
    spread, turn = np.linalg.eigh((inner + inner.T) / 2)
    return factor @ turn * np.sqrt(np.clip(spread, SHRINK**2, GROW**2))


def _derived(
    found: Round,
    drawn: np.ndarray,
    theta: np.ndarray,
    episode: Episode,
    rng: np.random.Generator,
) -> dict[str, np.ndarray]:
    mean, covariance = found.surrogate.nuisances(drawn)
    noise = rng.multivariate_normal(np.zeros(2), covariance[:2, :2], len(drawn))
    shifts = found.place.times + (mean[:, :2] + noise) * found.place.steps
    return {
        "damping_product": theta[:, DAMPING] * theta[:, SCALE],
        "hold_force": found.hold_force(drawn),
        "release_time": episode.release_time + shifts[:, 0],
        "camera_delay": -shifts[:, 1],
    }
