"""Simulate a recorded, planned or rehearsed pull."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from sling2sim2real.api.model import Model, Theta
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.planned import planned_pull
from sling2sim2real.simulator.initial import hanging_guess
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.replay import replay

LANES = 16  # rollouts that cost as much as one


@dataclass(frozen=True)
class Simulation:
    """A simulated pull, on the episode's clock, frame O, SI units.

    Attributes:
        time: Middle of each sample, shape (T,).
        force: Of the band on the gripper, filtered and averaged as a recorded one, shape (T, 3).
        step_time: Ends of the simulator's steps, irregular, shape (S,).
        step_force: The force there, unfiltered, shape (S, 3).
        cloud_time: Stamps of the camera frames, shape (K,).
        center_line: Nodes of the band at those, shape (K, L, 3).
        failure: None, or why the simulation counts for nothing.
    """

    time: np.ndarray
    force: np.ndarray
    step_time: np.ndarray
    step_force: np.ndarray
    cloud_time: np.ndarray
    center_line: np.ndarray
    failure: str | None


def simulate(model: Model, episode: Episode) -> Simulation:
    """Simulate an episode's pull: the hand goes where it went there, and lets go when it did.

    >>> from sling2sim2real import Band, Model, Settings, Theta, pull, simulate
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
    >>> simulated = simulate(model, pull(model, draw=(-0.40, 0.0)))
    >>> simulated.force.shape, simulated.center_line.shape
    ((166, 3), (148, 17, 3))
    >>> print(f"{simulated.force[:, 1].max():.0f} N")
    13 N

    Args:
        model: The band.
        episode: Recorded (`read_mcap`, `episode_from_arrays`) or planned (`pull`).

    Raises:
        UserError: The episode has no pull. A simulation that fails says so in `failure`.
    """
    return simulate_batch(model, episode, [model.theta])[0]


def simulate_batch(model: Model, episode: Episode, thetas: Sequence[Theta]) -> list[Simulation]:
    """The same for many θ of one law, 16 for the price of one, on all cores.

    >>> from sling2sim2real import Band, Model, Settings, Theta, pull, simulate_batch
    >>> thetas = [Theta(young, 0.47, 2.4e-3, 0.7, 0.6) for young in (1e5, 2e5)]
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, thetas[0], settings=Settings.coarse())
    >>> soft, stiff = simulate_batch(model, pull(model), thetas)
    >>> print(f"{stiff.force[:, 1].max() / soft.force[:, 1].max():.1f}")
    2.0

    Args:
        model: The band; its own θ is not used.
        episode: As for `simulate`.
        thetas: N, all neo-Hookean or all of rubber, as `model.theta` is.

    Raises:
        UserError: They are not of one law, or the episode has no pull.
    """
    if not thetas or {theta.law for theta in thetas} != {model.theta.law}:
        raise UserError(f"thetas: give some, all of the model's law, {model.theta.law}")
    parameters = Parameters(model.theta.law, np.stack([theta.point for theta in thetas]))

    def part(some: Parameters) -> list[Simulation]:
        done = replay(model.sling, episode, some, model.settings.force)
        rollouts = done.rollouts
        return [
            Simulation(
                time=episode.time,
                force=done.force[i],
                step_time=rollouts.times,
                step_force=rollouts.force[i],
                cloud_time=episode.cloud_time,
                center_line=rollouts.center_line[i],
                failure=why,
            )
            for i, why in enumerate(rollouts.failure)
        ]

    with ThreadPoolExecutor(cores()) as pool:
        some = [parameters[i : i + LANES] for i in range(0, len(parameters), LANES)]
        return [simulation for each in pool.map(part, some) for simulation in each]


def pull(
    model: Model,
    draw: tuple[float, float] = (-0.40, 0.0),
    *,
    pull_time: float = 1.5,
    pause: float = 1.0,
    frame_rate: float = 30.0,
    dips: bool = False,
) -> Episode:
    """A planned pull: the hand takes the hanging band, lifts it, draws it, pauses and lets go.

    It has no force and no clouds: simulate it. `sling plan` writes one for a robot.

    >>> from sling2sim2real import Band, Model, Theta, pull
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> planned = pull(Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6)), draw=(-0.35, -0.10))
    >>> planned.position[planned.time < planned.release_time][-1].round(2).tolist()
    [0.0, -0.35, -0.1]

    Args:
        model: Whose band hangs in the fork.
        draw: Where the middle is drawn to (y, z), frame O [m].
        pull_time: For the way there [s].
        pause: From there to the release [s].
        frame_rate: Of the camera [Hz].
        dips: Whether it lets the band back on its way, by `settings.plan.dips`.

    Raises:
        UserError: A time or a rate is not above 0.
    """
    if min(pull_time, pause, frame_rate) <= 0:
        raise UserError("pull: pull_time, pause and frame_rate must be above 0")
    hanging = hanging_guess(model.sling)[model.sling.middle, 2]
    inputs = model.settings.episode, model.band.name, hanging, draw
    return planned_pull(
        *inputs,
        pull_time=pull_time,
        pause=pause,
        frame_rate=frame_rate,
        dips=model.settings.plan.dips if dips else (),
    )
