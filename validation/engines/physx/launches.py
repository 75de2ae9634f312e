"""Launches in PhysX: the band pushes a projectile that is simulated beside it.

    python -m validation.engines.physx.launches band1 --theta 2.2e5,0.45,3e-3,1,1 [--rate 200]

PhysX cannot free what it leads, so the pouch stays led: where a projectile would go that feels the
band's force by PhysX's law (law.py) and gravity, with the mass of the held section. A step of the
projectile follows each step of PhysX (leapfrog), until the band no longer pushes along the launch;
the projectile then flies as ours does. In both engines alike the arm does not give way. PhysX's
band feels no air.
"""

from __future__ import annotations

import argparse
from contextlib import suppress
from dataclasses import replace

import numpy as np

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.base.minimum_jerk import minimum_jerk
from pipeline.export.mesh import Tube
from pipeline.identify.results.mounting import load_sling
from pipeline.params import Params, load
from pipeline.simulator.launch import launch
from pipeline.simulator.model import ClampedBand, LaunchSetup
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.rubber import NEO_HOOKEAN
from validation.engines.checks import SAME_MESH
from validation.engines.physx.bands import Drive, Engine
from validation.engines.physx.flight import Flight, Pushed, led_to
from validation.engines.physx.rollouts import ITERATIONS, RATE
from validation.engines.physx.study import clamped, hanging

PULL, REST = 1.5, 1.0  # s: the way to the draw, and at rest there before the release
FINE = 1000  # steps a second, to see what the paper's 200 do to a launch
COLUMNS = "draw_y_m", "draw_z_m", "ours_m", "physx_m", "ours_N", "physx_N", "gained"


def alike(params: Params) -> LaunchSetup:
    """How both engines launch: the arm does not give way."""
    return replace(LaunchSetup.of(params.setup, params.sling), arm_stiffness=None)


def launch_in_physx(
    engine: Engine,
    sling: ClampedBand,
    setup: LaunchSetup,
    thetas: np.ndarray,
    draws: np.ndarray,
    *,
    rate: int = RATE,
) -> Pushed:
    """Launch from draws (N, 2) with thetas (N, 5), all at once, in steps of 1 / rate.

    Raises UserError: as `Engine`, or for a law that PhysX does not have.
    """
    if sling.law != NEO_HOOKEAN:
        raise UserError(f"PhysX has no law {sling.law}; set law: {NEO_HOOKEAN}")
    tube = Tube.of(sling, **SAME_MESH)
    flight, phases = Flight(sling, setup, tube, thetas, draws, rate), course(tube, draws, rate)
    engine.simulate(tube, thetas, phases, rate=rate, iterations=ITERATIONS, steer=flight)
    return flight.outcome()


def course(tube: Tube, draws: np.ndarray, rate: int) -> list[Drive]:
    """Hang; then led straight to each of the draws (N, 2), and at rest there."""
    hand = np.arange(tube.mass.size).reshape(tube.rest.shape[:2])[tube.middle]
    times = np.arange(1, round((PULL + REST) * rate) + 1) / rate
    fade = 1 - minimum_jerk(times / PULL)
    targets = led_to(tube, np.column_stack([np.zeros(len(draws)), draws]))[None]
    led = np.concatenate([clamped(tube)[0], hand])
    return [hanging(tube, rate), Drive(led, targets, fade, np.zeros(len(times), bool))]


def draws_of(setup) -> np.ndarray:
    """Three draws on the diagonal of the box, shape (3, 2)."""
    low, high = np.array([setup.draw_y, setup.draw_z]).T
    return low + np.array([[0.25], [0.5], [0.75]]) * (high - low)


def theta_of(text: str) -> np.ndarray:
    """The five parameters, shape (5,). Raises UserError."""
    with suppress(ValueError):
        theta = np.array(text.split(","), float)
        if theta.shape == (5,) and theta[0] > 0 and 0 < theta[1] < 0.5 and (theta >= 0).all():
            return theta
    raise UserError(f"--theta {text}: needs E,nu,d,mu,s, five numbers, nu between 0 and 0.5")


def main() -> None:
    """Print where PhysX and ours land. Raises UserError."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("band")
    parser.add_argument("--theta", required=True, help="E,nu,d,mu,s")
    parser.add_argument("--rate", type=int, default=RATE, help="PhysX's steps a second")
    parser.add_argument("--params", default="params.yaml")
    requested = parser.parse_args()
    if requested.rate < 1:
        raise UserError(f"--rate {requested.rate}: must be a whole number above 0")
    params = load(requested.params)
    if requested.band not in params.bands:
        raise UserError(f"no band {requested.band} in {requested.params}")
    sling, setup = load_sling(params, requested.band), alike(params)
    draws = draws_of(params.setup)
    thetas = np.tile(theta_of(requested.theta), (len(draws), 1))
    ours = launch(sling, setup, Parameters.of(sling.law, thetas), draws)
    with Engine() as engine:
        theirs = launch_in_physx(engine, sling, setup, thetas, draws, rate=requested.rate)
    print(*(f"{name:>9}" for name in COLUMNS), " PhysX: why not")
    done = theirs.launches
    columns = *draws.T, ours.landing_y, done.landing_y, ours.hold_force, done.hold_force
    for *row, why in zip(*columns, theirs.gained, done.failure, strict=True):
        print(*(f"{number:9.3f}" for number in row), f" {why or ''}")


if __name__ == "__main__":
    errors.run(main)
