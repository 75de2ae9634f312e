"""Launch from a draw, and find the draw for a target, in the calibrated simulator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sling2sim2real.api.arguments import drawn, number
from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import UserError
from sling2sim2real.launching.surface.aim import landings_within, secants
from sling2sim2real.launching.trials.spread import landing_intervals
from sling2sim2real.launching.trials.stretch import stretch_of
from sling2sim2real.simulator.launch import Launches, limited
from sling2sim2real.simulator.parameters import Parameters

FINE = 201  # nodes along y and z, between which a target is sought on the map
TARGETS = 0.1, 20.0  # m
TRIES = 8  # launches at most to get there from the map
ROUNDING = 1e-3  # of a stretch


@dataclass(frozen=True)
class Launch:
    """A predicted launch, frame O, SI units; NaN where `failure` says why there is none.

    Attributes:
        draw: Where the arm is sent to with the projectile (y, z).
        landing: Where the projectile meets the floor, along y.
        speed, angle: As it leaves the pouch [m/s, rad above the horizon].
        separation: Where it leaves (y, z).
        hold_force: Of the drawn band on the hand; known for most failed launches too.
        failure: None, or why it does not land beyond the fork, or may not be drawn.
    """

    draw: tuple[float, float]
    landing: float
    speed: float
    angle: float
    separation: tuple[float, float]
    hold_force: float
    failure: str | None


@dataclass(frozen=True)
class Aim:
    """Where to draw for a target.

    Attributes:
        target: Asked for, along y on the floor [m].
        draw: Where to send the arm (y, z), frame O [m].
        launch: What the simulator predicts there.
        interval_90: Nine of ten landings lie in it [m]: θ's samples, and an error of
            `settings.trials.actuation_error` along each axis of the draw. None where too many
            launches beside the predicted one fail.
        pull_and_pause: In how long the hand must draw and how long it must wait [s]; None where
            the law does not remember it.
        warnings: What the numbers do not rest on; read them before a robot moves.
    """

    target: float
    draw: tuple[float, float]
    launch: Launch
    interval_90: tuple[float, float] | None
    pull_and_pause: tuple[float, float] | None
    warnings: tuple[str, ...]


def launch(model: Model, draw: tuple[float, float]) -> Launch:
    """Launch the projectile from one draw; `Model.launches` takes many at once.

    >>> from sling2sim2real import Band, Model, Theta, launch
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6))
    >>> shot = launch(model, draw=(-0.30, -0.15))
    >>> print(f"{shot.landing:.1f} m, {shot.hold_force:.0f} N")
    2.0 m, 8 N

    Args:
        model: From `identify`, or written by hand.
        draw: (y, z) in frame O, y < 0, above the floor [m].

    Raises:
        UserError: No such draw can be. A launch that fails says so in `failure`.
    """
    draw = drawn(draw, -model.settings.setup.fork_height)
    done = limited(model.launches(np.array(draw)), model.settings.setup.max_force)
    return Launch(
        draw=draw,
        landing=float(done.landing_y[0]),
        speed=float(done.speed[0]),
        angle=float(done.angle[0]),
        separation=(float(done.separation_y[0]), float(done.separation_z[0])),
        hold_force=float(done.hold_force[0]),
        failure=done.failure[0],
    )


def aim(model: Model, target: float) -> Aim:
    """The draw for a target: that of the run's policy, as `sling aim` has it, or the gentlest.

    `Identification.of_run` knows the policy that the run trained. Other models have none: launches
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
    >>> aimed.warnings
    ('no samples of θ: the interval holds the error of the draw alone',)

    Args:
        model: From `identify`, whose samples make the interval; or written by hand.
        target: Along y, on the floor [m].

    Raises:
        UserError: No draw in the box and within the arm's force lands there.
    """
    target = number("target", target, *TARGETS)
    policy = getattr(model, "policy", None)
    if policy is None:
        draw = _refined(model, _gentlest(model, target), target)
    else:
        draw = policy.draws(np.array([target]))[0]
    launched = launch(model, tuple(draw))
    if launched.failure:
        raise UserError(f"target {target:g} m: the draw for it fails: {launched.failure}")
    samples = getattr(model, "samples", None)

    def launcher(draws: np.ndarray, parameters: Parameters = model.theta.parameters) -> Launches:
        return model.launches(draws, parameters.values)

    error = model.settings.trials.actuation_error
    sampled = None if samples is None else Parameters(model.theta.law, samples)
    low, high = landing_intervals(launcher, draw, sampled, error)[0].tolist()
    interval, history = ((low, high) if low == low else None), model.launch_setup.history
    return Aim(
        target=float(target),
        draw=launched.draw,
        launch=launched,
        interval_90=interval,
        pull_and_pause=history and (history.pull_time, history.pause),
        warnings=tuple(_warnings(model, launched.draw, samples, interval)),
    )


def _gentlest(model: Model, target: float) -> np.ndarray:
    """Draw of least force, (2,), of those that the map lands on the target. Raises UserError."""
    surface = model.landing_map
    grid, landing = landings_within(surface, FINE)
    off = landing - target
    here, next_ = off[:-1], off[1:]
    hit = np.nonzero((here * next_ <= 0) & (here != next_))
    if not len(hit[0]):
        reach = "none of them lands"
        if np.isfinite(landing).any():
            reach = f"they land from {np.nanmin(landing):.2f} to {np.nanmax(landing):.2f} m"
        raise UserError(
            f"target {target:g} m: no draw of the box (setup.draw_y, draw_z) that the arm can hold"
            f" lands there; {reach}"
        )
    part = (here[hit] / (here[hit] - next_[hit]))[:, None]
    draws = (1 - part) * grid[:-1][hit] + part * grid[1:][hit]
    return draws[np.argmin(surface(draws).hold_force)]


def _refined(model: Model, draw: np.ndarray, target: float) -> np.ndarray:
    """The draw (2,) on the line through the fork that lands NEAR the target, by secants."""

    def off(length: float) -> float:
        return float(model.launches(length * draw).landing_y[0]) - target

    # a landing grows about as the draw squared
    return secants(off, off(1.0), 2 * target, TRIES)[0] * draw


def _warnings(
    model: Model,
    draw: tuple[float, float],
    samples: np.ndarray | None,
    interval: tuple[float, float] | None,
) -> Iterator[str]:
    if samples is None:
        yield "no samples of θ: the interval holds the error of the draw alone"
    elif not getattr(model, "settled", False):
        yield "the fit has not converged: do not trust the interval"
    if interval is None:
        yield "no interval: too many launches beside the predicted one fail"
    sizes = model.settings.setup.fork_width, model.band.rest_length
    requested = float(stretch_of(np.array([[0.0, *draw]]), *sizes)[0])
    recorded = getattr(model, "stretch", None)
    if recorded is not None and requested > recorded + ROUNDING:
        yield (
            f"the draw stretches the band by {100 * (requested - 1):.1f} %, its recordings by"
            f" {100 * (recorded - 1):.1f} % at most: force and landing are extrapolated"
        )
    policy = getattr(model, "policy", None)
    if policy is not None and policy.card()["theta"] != model.theta.content("")["theta"]:
        yield "the policy was trained with another θ than there is now"
    for change in getattr(model, "changed", ()):
        yield f"params.yaml: {change}, since θ was identified"
