"""Launch from a draw, and find the draw for a target, in the calibrated simulator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sling2sim2real.api.arguments import drawn, number
from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import Refused
from sling2sim2real.launching.surface.aim import landings_within, secants
from sling2sim2real.launching.trials.spread import landing_intervals
from sling2sim2real.launching.trials.stretch import stretch_of
from sling2sim2real.quantities import QUANTITIES
from sling2sim2real.simulator.launch import Launches, limited
from sling2sim2real.simulator.parameters import Parameters

FINE = 201  # nodes along y and z, between which a target is sought on the map
TARGETS = 0.1, 20.0  # m
TRIES = 8  # launches at most to get there from the map
ROUNDING = 1e-3  # of a stretch
MISS = 0.05  # m from the target, in simulation, from which a draw is no answer
FEW_SAMPLES = 30  # by so many an end of an interval is known to a fifth of its width


@dataclass(frozen=True)
class Hazard:
    """A reason not to trust an answer: `about` is for programs, `what` for people.

    Attributes:
        about: box, stretch, force, confidence, stale, target, miss, failure or interval.
    """

    about: str
    what: str

    def __str__(self) -> str:
        return self.what


@dataclass(frozen=True)
class Launch:
    """A predicted launch, frame O, SI units; NaN where `failure` says why there is none.

    Attributes:
        draw: Where the arm is sent to with the projectile (y, z).
        landing: Where the projectile meets the floor, along y.
        interval_90: Nine of ten landings lie in it [m]: θ's samples, and an error of
            `settings.trials.actuation_error` along each axis of the draw. None where too many
            launches beside the predicted one fail.
        speed, angle: As it leaves the pouch [m/s, rad above the horizon].
        separation: Where it leaves (y, z).
        hold_force: Of the drawn band on the hand; known for most failed launches too.
        pull_and_pause: In how long the hand must draw and how long it must wait [s]; None where
            the law does not remember it.
        failure: None, or why it does not land beyond the fork, or may not be drawn.
        warnings: What the numbers do not rest on; read them before a robot moves.
    """

    draw: tuple[float, float]
    landing: float
    interval_90: tuple[float, float] | None
    speed: float
    angle: float
    separation: tuple[float, float]
    hold_force: float
    pull_and_pause: tuple[float, float] | None
    failure: str | None
    warnings: tuple[Hazard, ...]


@dataclass(frozen=True)
class Aim:
    """Where to draw for a target.

    Attributes:
        target: Asked for, along y on the floor [m].
        launch: What the simulator predicts of the draw.
        warnings: Those of the launch, and what speaks against the target.
    """

    target: float
    launch: Launch
    warnings: tuple[Hazard, ...]

    @property
    def draw(self) -> tuple[float, float]:
        """Where to send the arm (y, z), frame O [m]."""
        return self.launch.draw

    @property
    def interval_90(self) -> tuple[float, float] | None:
        """Nine of ten landings lie in it [m]."""
        return self.launch.interval_90

    @property
    def pull_and_pause(self) -> tuple[float, float] | None:
        """In how long the hand must draw and how long it must wait [s]."""
        return self.launch.pull_and_pause


def launch(model: Model, draw: tuple[float, float], *, error: float | None = None) -> Launch:
    """Launch the projectile from one draw; `Model.launches` takes many at once.

    >>> from sling2sim2real import Band, Model, Theta, launch
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6))
    >>> shot = launch(model, draw=(-0.30, -0.15))
    >>> print(f"{shot.landing:.1f} m, {shot.hold_force:.0f} N")
    2.0 m, 8 N
    >>> low, high = shot.interval_90
    >>> low < shot.landing < high
    True
    >>> print(*shot.warnings)
    no samples of θ: the interval holds the error of the draw alone

    Args:
        model: From `identify`, whose samples make the interval; or written by hand.
        draw: (y, z) in frame O, y < 0, above the floor [m].
        error: Standard deviation of the draw along each axis [m]; None: that of a commanded one,
            `settings.trials.actuation_error`.

    Raises:
        UserError: No such draw can be. A launch that fails says so in `failure`.
    """
    setup, history = model.settings.setup, model.launch_setup.history
    draw = drawn(draw, -setup.fork_height)
    done = limited(model.launches(np.array(draw)), setup.max_force)
    force, failure = float(done.hold_force[0]), done.failure[0]
    error = model.settings.trials.actuation_error if error is None else error
    interval = None if failure else _interval(model, draw, error)
    return Launch(
        draw=draw,
        landing=float(done.landing_y[0]),
        interval_90=interval,
        speed=float(done.speed[0]),
        angle=float(done.angle[0]),
        separation=(float(done.separation_y[0]), float(done.separation_z[0])),
        hold_force=force,
        pull_and_pause=history and (history.pull_time, history.pause),
        failure=failure,
        warnings=tuple(_hazards(model, draw, force, failure, interval)),
    )


def aim(model: Model, target: float, *, anyway: bool = False) -> Aim:
    """The draw for a target: that of the trained policy, where there is one, or the gentlest.

    `Identification.load` knows the policy in a band's folder. Other models have none: launches
    over the box are simulated once a model (`Model.landing_map`), of all draws that land on the
    target that of least force is read off them, and a few more launches along the draw's own line
    bring it there.

    >>> from sling2sim2real import Band, Model, Settings, Theta, aim
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
    >>> aimed = aim(model, target=2.0)
    >>> print(f"{aimed.launch.landing:.2f} m")
    2.00 m
    >>> low, high = aimed.interval_90
    >>> low < 2.0 < high
    True

    Args:
        model: From `identify`, whose samples make the interval; or written by hand.
        target: Along y, on the floor [m].
        anyway: Answer though the draw misses, fails, or pulls too hard.

    Raises:
        Refused: It does: the line says which targets can be hit.
    """
    target = number("target", target, *TARGETS)
    launched = launch(model, tuple(draw_for(model, target)))
    hazards = list(_of_target(model, launched, target))
    why = launched.failure or next((str(h) for h in hazards if h.about == "miss"), None)
    if why and not anyway:
        raise Refused(f"target {target:g} m: {why}{_reach(model)}")
    return Aim(float(target), launched, (*hazards, *launched.warnings))


def _interval(model: Model, draw: tuple[float, float], error: float) -> tuple[float, float] | None:
    samples = getattr(model, "samples", None)

    def launcher(draws: np.ndarray, parameters: Parameters = model.parameters) -> Launches:
        return model.launches(draws, parameters.values)

    sampled = None if samples is None else Parameters(model.theta.law, samples)
    low, high = landing_intervals(launcher, np.array(draw), sampled, error)[0].tolist()
    return (low, high) if low == low else None


def _of_target(model: Model, launched: Launch, target: float) -> Iterator[Hazard]:
    policy, (low, high) = getattr(model, "policy", None), model.settings.policy.targets
    if policy is not None and not low <= target <= high:
        what = f"the policy was trained for targets from {low:g} to {high:g} m, not {target:g} m"
        yield Hazard("target", what)
    if policy is not None and policy.card().get("theta") != model.theta.content("")["theta"]:
        what = "the policy was trained with another θ than there is now: train it anew"
        yield Hazard("stale", what)
    off = launched.landing - target
    if abs(off) > MISS:
        yield Hazard("miss", f"the draw for it lands {off:+.2f} m off in simulation")


def _reach(model: Model) -> str:
    """What can be hit, in words."""
    landing = landings_within(model.landing_map, FINE)[1]
    if not np.isfinite(landing).any():
        return "; none of the box (setup.draw_y, draw_z) does"
    low, high = np.nanmin(landing), np.nanmax(landing)
    return f"; draws of the box (setup.draw_y, draw_z) land from {low:.2f} to {high:.2f} m"


def draw_for(model: Model, target: float) -> np.ndarray:
    """Draw (2,) for a target [m]: the policy's, or else the gentlest, or the nearest if none hits.

    Raises Refused where no draw of the box lands at all.
    """
    policy = getattr(model, "policy", None)
    if policy is not None:
        return policy.draws(np.array([target]))[0]
    surface = model.landing_map
    grid, landing = landings_within(surface, FINE)
    off = landing - target
    if not np.isfinite(off).any():
        raise Refused(f"target {target:g} m: no draw lands{_reach(model)}")
    here, next_ = off[:-1], off[1:]
    hit = np.nonzero((here * next_ <= 0) & (here != next_))
    if not len(hit[0]):
        return grid[np.unravel_index(np.nanargmin(np.abs(off)), off.shape)]
    part = (here[hit] / (here[hit] - next_[hit]))[:, None]
    draws = (1 - part) * grid[:-1][hit] + part * grid[1:][hit]
    return _refined(model, draws[np.argmin(surface(draws).hold_force)], target)


def _refined(model: Model, draw: np.ndarray, target: float) -> np.ndarray:
    """The draw (2,) on the line through the fork that lands NEAR the target, by secants."""

    def off(length: float) -> float:
        return float(model.launches(length * draw).landing_y[0]) - target

    # a landing grows about as the draw squared
    return secants(off, off(1.0), 2 * target, TRIES)[0] * draw


def _hazards(
    model: Model,
    draw: tuple[float, float],
    force: float,
    failure: str | None,
    interval: tuple[float, float] | None,
) -> Iterator[Hazard]:
    """What a launch's numbers do not rest on."""
    setup, confidence = model.settings.setup, getattr(model, "confidence", {})
    if failure:
        about = "force" if force > setup.max_force else "failure"
        yield Hazard(about, f"the launch fails in simulation: {failure}")
    elif interval is None:
        yield Hazard("interval", "no interval: too many launches beside the predicted one fail")
    for axis, value in zip("yz", draw, strict=True):
        low, high = getattr(setup, f"draw_{axis}")
        if not low - 1e-6 <= value <= high + 1e-6:
            yield Hazard(
                "box",
                f"the draw's {axis} = {value:g} m lies outside setup.draw_{axis}"
                f" [{low:g}, {high:g}], where the arm reaches",
            )
    requested = float(
        stretch_of(np.array([[0.0, *draw]]), setup.fork_width, model.band.rest_length)[0]
    )
    recorded = getattr(model, "stretch", None)
    if recorded is not None and requested > recorded + ROUNDING:
        yield Hazard(
            "stretch",
            f"the draw stretches the band by {100 * (requested - 1):.1f} %, its recordings by"
            f" {100 * (recorded - 1):.1f} % at most: force and landing are extrapolated",
        )
    if getattr(model, "samples", None) is None:
        what = "no samples of θ: the interval holds the error of the draw alone"
        yield Hazard("confidence", what)
    elif edges := confidence.get("edges"):
        name, side = next(iter(edges.items()))
        where = f"{QUANTITIES[name].label} is at the {side} end of its bounds"
        yield Hazard("confidence", f"{where}: do not trust the interval")
    elif not confidence.get("settled"):
        yield Hazard("confidence", "the fit has not converged: do not trust the interval")
    elif (effective := confidence.get("effective_samples") or np.inf) < FEW_SAMPLES:
        what = f"the interval rests on {effective:.0f} samples of even weight, too few"
        yield Hazard("confidence", what)
    if getattr(model, "stale", False):
        what = "recordings, launches or settings have changed since: `sling fit` makes θ anew"
        yield Hazard("stale", what)
