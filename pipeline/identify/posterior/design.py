"""Which dips of a pull would narrow the interval of a landing most.

Near any parameters, force and log landing are linear in the coordinates phi. A recording of a pull
of known derivatives J then leaves of the prior precision P the covariance

    C = (P + J' S^-1 J)^-1,    expected variance of a log landing: mean over prior draws of g' C g

with S the force's noise and what a recording leaves open of it (bias, drift, clock), and g the
launch's gradient (Chaloner and Verdinelli, Bayesian experimental design, 10.1214/ss/1177009939:
linear, c-optimal, averaged over the prior). Pictures of the recoil are left out: they tell of the
damping alone, and the same after every pull. So is what the law gets wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from pipeline.episode.episode import Episode
from pipeline.episode.planned import leg_time, planned_pull
from pipeline.episode.signal import average
from pipeline.identify.posterior.coordinates import LOGS, Coordinates
from pipeline.identify.posterior.gain import HALF, HALF_NORMAL
from pipeline.identify.posterior.likelihood import Tolerances
from pipeline.identify.posterior.residuals import Rule
from pipeline.params import Params
from pipeline.params.identification import LAWS
from pipeline.params.lab import Dip
from pipeline.simulator.initial import hanging_guess
from pipeline.simulator.interaction import interact
from pipeline.simulator.launch import launch, memory_of_pull
from pipeline.simulator.model import ClampedBand, LaunchHistory, LaunchSetup
from pipeline.simulator.rubber import RUBBER, uniaxial

DRAWS = 20  # of the prior
PLACES = 9  # of a draw that are tried for the targets
SOFTENING = "softening", (0.0, 0.6)  # free, whatever the method fixes, and its bounds
SHOWN_BY_FORCE = (*LOGS, *LAWS[RUBBER])  # what a pull's force shows
MOST_DIPS = 3
FIRST, SHALLOW, DEEPEST = 0.5, 0.05, 0.9  # shares: where a dip may begin, and how deep it may go
SLOWER, SLOWEST = 2.0, 4.0  # s of a leg: of the coarse set, and at most
TICK = 0.05  # s, of a leg
REFINED = 40  # pulls that the last search may try
RHO = 0.15  # of the unit cube, its first step
UNIFORM = 1 / 12  # variance of an even distribution over 1


@dataclass(frozen=True)
class PullLimits:
    """What the arm allows.

    Attributes:
        speed, acceleration: Of the hand [m/s, m/s^2].
        spare: For all dips together [s].
    """

    speed: float
    acceleration: float
    spare: float

    def shortest(self, length: float) -> float:
        """Time [s] of a leg of a length [m]."""
        return leg_time(length, self.speed, self.acceleration)


@dataclass(frozen=True)
class PullDesign:
    """A band of N prior draws, drawn to one place, and T targets.

    Attributes:
        params, sling: Whose episodes, tolerances and steps; the band, of the law rubber.
        draw: Of the recording (y, z), frame O [m].
        times: Of the pull, and of the pause [s].
        coordinates: D of them, with the softening free.
        phi: Prior draws, shape (N, D).
        precision: Of the prior, shape (D,); an even one tells as its variance does.
        gradient: Of log landings at the targets, shape (N, T, D).
        workers: Threads.
    """

    params: Params
    sling: ClampedBand
    draw: tuple[float, float]
    times: tuple[float, float]
    coordinates: Coordinates
    phi: np.ndarray
    precision: np.ndarray
    gradient: np.ndarray
    workers: int

    @classmethod
    def of(
        cls,
        params: Params,
        method: str,
        band: str,
        draw: tuple[float, float],
        times: tuple[float, float],
        force: float,
        targets: Sequence[float],
        workers: int = 1,
    ) -> PullDesign:
        """Design for a band of params.yaml that `force` [N] holds at the draw, more or less.

        Args:
            method: Of params.yaml, whose law is rubber.
            times: As the attribute.
            targets: Landings [m].
        """
        method_params = params.methods[method]
        name, bounds = SOFTENING
        method_params = method_params.model_copy(
            update={
                "fixed": {key: value for key, value in method_params.fixed.items() if key != name},
                "bounds": {name: bounds} | dict(method_params.bounds),
            }
        )
        params = params.model_copy(
            update={"methods": dict(params.methods) | {method: method_params}}
        )
        sling = ClampedBand.of(params.bands[band], params.setup, params.sling, law=RUBBER)
        coordinates = Coordinates.of_method(params, method, sling)
        rng = np.random.default_rng(params.optimizer.seed)
        phi, precision = sampled(coordinates, DRAWS, rng)
        young = coordinates.names.index(LOGS[0])
        history = LaunchHistory(*times, deepest=float(np.hypot(*draw)))
        phi[:, young] = np.log(modulus(sling, coordinates, phi, draw, force, history))
        setup = LaunchSetup.of(params.setup, params.sling, history)
        box = np.array([params.setup.draw_y, params.setup.draw_z])[:, ::-1].T  # shallow, deep
        land = _Landings(sling, setup, coordinates, box, workers)
        gradient = land.gradient(phi, land.aimed(phi, targets))
        good = np.isfinite(gradient).all(axis=(1, 2))
        return cls(
            params, sling, draw, times, coordinates, phi[good], precision, gradient[good], workers
        )

    def variances(self, dips: Sequence[Dip]) -> np.ndarray:
        """Expected variances of the log landings after a pull with these dips, shape (T,)."""
        progress = self.information(dips) + np.diag(self.precision)
        return self._left(np.linalg.inv(progress))

    @property
    def before(self) -> np.ndarray:
        """The same of the prior alone, shape (T,)."""
        return self._left(np.diag(1 / self.precision))

    def _left(self, covariance: np.ndarray) -> np.ndarray:
        g = self.gradient
        return (g @ covariance * g).sum(axis=2).mean(axis=0)

    def episode(self, dips: Sequence[Dip]) -> Episode:
        """The planned pull, with one picture, of the hanging band."""
        hanging = hanging_guess(self.sling)[self.sling.middle, 2]
        pull_time, pause = self.times
        description = {"pull_time": pull_time, "pause": pause, "dips": dips}
        made = planned_pull(self.params.episode, "planned", hanging, self.draw, **description)
        return replace(made, cloud_time=made.cloud_time[:1], clouds=made.clouds[:1])

    def information(self, dips: Sequence[Dip]) -> np.ndarray:
        """J' S^-1 J of the force of a pull, at each draw, shape (N, D, D).

        None at draws at which a simulation does not reach its end.
        """
        episode, steps = self.episode(dips), self.coordinates.steps
        affected = [i for i, name in enumerate(self.coordinates.names) if name in SHOWN_BY_FORCE]
        moved = np.vstack([0 * steps, np.diag(steps)[affected]])
        count, size = len(self.phi), len(moved)
        around = (self.phi[:, None] + moved).reshape(count * size, -1)
        done = interact(
            self.sling,
            episode,
            self.coordinates.parameters(around),
            until=episode.release_time,
            workers=self.workers,
        )
        failed = np.array([why is not None for why in done.failure]).reshape(count, size)
        along = np.moveaxis(
            done.force[..., 1:].astype(float), 1, 0
        )  # none across the pull, along x
        sampling = episode.time[0] - episode.sample_period / 2, episode.sample_period
        # without the recorded force's low-pass, which a leg of 0.2 s passes unchanged
        force = average(done.times, along, *sampling, len(episode.time))
        force = np.moveaxis(force[Rule().samples(episode)], 0, 1).reshape(count, size, -1, 2)
        progress = np.zeros((count, len(steps), len(steps)))
        for lane_force, bad, at in zip(force, failed, progress, strict=True):
            if not bad.any():
                slopes = (lane_force[1:] - lane_force[0]) / steps[affected, None, None]
                at[np.ix_(affected, affected)] = eliminated(
                    slopes, lane_force[0], episode.sample_period
                )
        return progress


def sampled(
    coordinates: Coordinates, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Prior draws (count, D) within the bounds, and the precision of each coordinate (D,).

    Gaussian where a prior is given, else even. Each is drawn in `count` equal parts, in an order of
    its own (Latin hypercube), so that few draws are spread as many would be.
    """
    from scipy.stats.qmc import LatinHypercube

    even = LatinHypercube(len(coordinates.names), rng=rng).random(count)
    low, high = coordinates.low, coordinates.high
    precision = coordinates.precision.copy()
    flat = precision == 0
    precision[flat] = 1 / (UNIFORM * (high - low)[flat] ** 2)
    for name in {*HALF} & {*coordinates.names}:
        precision[coordinates.names.index(name)] /= HALF_NORMAL
    return coordinates.quantiles(even), precision


def modulus(
    sling: ClampedBand,
    coordinates: Coordinates,
    phi: np.ndarray,
    draw: tuple[float, float],
    force: float,
    history: LaunchHistory,
) -> np.ndarray:
    """Young's modulus [Pa] of which straight halves at phi (N, D) hold `force` [N], (N,).

    After a pull and a pause, which leave some of the flow's stress.
    """
    far = float(np.hypot(*draw))
    stretch, lean = float(sling.drawn(np.array(far))), far / np.hypot(far, sling.half_width)
    shape = (phi[:, coordinates.names.index(name)] for name in ("mooney_share", "upturn"))
    parameters = coordinates.parameters(phi)
    draws = np.broadcast_to(draw, (len(phi), 2))
    flowing = memory_of_pull(sling, history, parameters, draws)["unflowed"]
    pull = uniaxial(np.array(stretch), *shape) * (1 + parameters.column("flow") * flowing)
    return 3 * force / (2 * sling.area * lean * pull)


def eliminated(slopes: np.ndarray, force: np.ndarray, period: float) -> np.ndarray:
    """J' S^-1 J (F, F) of derivatives (F, S, 2) of a force (S, 2) [N] sampled at `period` [s].

    What the recording leaves open is eliminated as `Likelihood` does: bias, drift, clock.
    """
    has, course = Tolerances(), np.linspace(0, 1, force.shape[0])
    nuisances = [has.pose * np.gradient(force, period, axis=0)]
    for axis in np.eye(force.shape[1]):
        nuisances += [has.bias * np.outer(np.ones_like(course), axis)]
        nuisances += [has.drift * np.outer(course, axis)]
    j, n = (
        np.reshape(columns, (len(columns), -1)) / has.force
        for columns in (slopes, np.array(nuisances))
    )
    across = j @ n.T
    return j @ j.T - across @ np.linalg.solve(n @ n.T + np.eye(len(n)), across.T)


@dataclass(frozen=True)
class _Landings:
    """Launches between the shallow and the deep corner of the box of draws, `box` (2, 2) [m]."""

    sling: ClampedBand
    setup: LaunchSetup
    coordinates: Coordinates
    box: np.ndarray
    workers: int

    def _log(self, phi: np.ndarray, part: np.ndarray) -> np.ndarray:
        """Log landings of M coordinates from M parts of the way between the corners, (M,)."""
        draws = self.box[0] + part[:, None] * (self.box[1] - self.box[0])
        parameters = self.coordinates.parameters(phi)
        done = launch(self.sling, self.setup, parameters, draws, workers=self.workers)
        return np.log(done.landing_y)

    def aimed(self, phi: np.ndarray, targets: Sequence[float]) -> np.ndarray:
        """Parts of the way from which N coordinates land at or nearest to T targets, (N, T)."""
        parts = np.linspace(0, 1, PLACES)
        every = self._log(np.repeat(phi, PLACES, axis=0), np.tile(parts, len(phi)))
        draws = np.full((len(phi), len(targets)), np.nan)
        for row, landed in zip(draws, every.reshape(len(phi), -1), strict=True):
            good = np.isfinite(landed)
            if good.any():
                row[:] = np.interp(
                    np.log(targets), np.maximum.accumulate(landed[good]), parts[good]
                )
        return draws

    def gradient(self, phi: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """Gradient of log landings in the coordinates, (N, T, D); NaN where a launch fails."""
        steps = self.coordinates.steps
        moved = np.vstack([0 * steps, np.diag(steps)])
        n, t, m = *parts.shape, len(moved)
        finite = np.nan_to_num(parts)
        at = np.broadcast_to((phi[:, None] + moved)[:, None], (n, t, m, len(steps)))
        logs = self._log(at.reshape(n * t * m, -1), np.repeat(finite.ravel(), m)).reshape(n, t, m)
        change = (logs[..., 1:] - logs[..., :1]) / steps
        return np.where(np.isfinite(parts)[..., None], change, np.nan)


def searched(
    design: PullDesign,
    limits: PullLimits,
    progress: Callable[[Sequence[Dip], float], None] = lambda dips, variance: None,
) -> tuple[Dip, ...]:
    """The best dips found: up to MOST_DIPS of a coarse set one by one, then all moved together.

    Args:
        progress: Of each pull that was tried, and the mean of its variances.
    """
    size, gains = float(np.hypot(*design.draw)), {}

    def value(dips: tuple[Dip, ...]) -> float:
        if dips not in gains:
            gains[dips] = float(design.variances(dips).mean())
            progress(dips, gains[dips])
        return gains[dips]

    best: tuple[Dip, ...] = ()
    for _ in range(MOST_DIPS):
        tried = [(*best, dip) for dip in candidates(size, limits)]
        tried = [dips for dips in tried if lasts(dips) <= limits.spare]
        best = min([best, *tried], key=value)

    def height(x: np.ndarray) -> float:
        dips = _of_unit(x, size, limits)
        late = lasts(dips) - limits.spare
        return np.log(value(dips)) if late <= 0 else np.log(value(best)) + late

    if best:
        start = np.concatenate([_unit(dip, size, limits) for dip in best])
        minimize(
            height,
            start,
            method="COBYLA",
            bounds=[(0, 1)] * len(start),
            options={"rhobeg": RHO, "tol": RHO / 5, "maxiter": REFINED},
        )
    return min(gains, key=lambda dips: gains[dips])


def lasts(dips: Sequence[Dip]) -> float:
    """All of them [s]."""
    return sum(dip.out_time + dip.back_time for dip in dips)


def candidates(size: float, limits: PullLimits) -> Iterator[Dip]:
    """Dips of a draw of `size` [m]: shallow to deep, as fast as the arm can and slower."""
    for at, part in ((1.0, 0.1), (1.0, 0.25), (1.0, 0.5), (1.0, 0.75), (0.7, 0.5)):
        fastest = limits.shortest(part * at * size)
        for time in dict.fromkeys((fastest, max(fastest, SLOWER))):
            yield _rounded(at, part * at * size, time, time)


def _rounded(at: float, depth: float, *times: float) -> Dip:
    """Round a dip as one would write it; a time is not less than it is given."""
    out, back = (round(np.ceil(time / TICK - 1e-9) * TICK, 2) for time in times)
    return Dip(at=round(at, 2), depth=round(depth, 2), out_time=out, back_time=back)


def _unit(dip: Dip, size: float, limits: PullLimits) -> np.ndarray:
    """A dip as a place in the unit cube, shape (4,)."""
    shortest = limits.shortest(dip.depth)
    times = np.log(np.array([dip.out_time, dip.back_time]) / shortest) / np.log(SLOWEST / shortest)
    part = (dip.depth / (dip.at * size) - SHALLOW) / (DEEPEST - SHALLOW)
    return np.clip([(dip.at - FIRST) / (1 - FIRST), part, *times], 0, 1)


def _of_unit(x: np.ndarray, size: float, limits: PullLimits) -> tuple[Dip, ...]:
    """Dips of a place in the unit cube; quicker ones where they would take too long."""
    at, part, out, back = np.clip(x, 0, 1).reshape(-1, 4).T
    at = FIRST + (1 - FIRST) * at
    depth = np.round((SHALLOW + (DEEPEST - SHALLOW) * part) * at * size, 2)
    shortest = np.array([limits.shortest(depth_i) for depth_i in depth])
    longer = shortest * ((SLOWEST / shortest) ** np.array([out, back]) - 1)
    room = limits.spare - 2 * shortest.sum() - 2 * len(at) * TICK
    longer *= np.clip(room / max(longer.sum(), 1e-9), 0, 1)
    return tuple(map(_rounded, at, depth, *(shortest + longer)))
