"""What tests of the simulator share: parameters, a straight band, a band at rest."""

import numpy as np

from sling2sim2real.simulator.initial import sections_of
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.rubber import NEO_HOOKEAN
from sling2sim2real.simulator.schedule import Schedule, relaxation
from sling2sim2real.simulator.solver import Options, Slings, run

BASE = np.array([2e5, 0.42, 3e-3, 0.6, 0.6])
BOX = np.array([[3e4, 1e7], [0.30, 0.49], [1e-4, 5e-2], [0.05, 1.0], [0.0, 1.0]])
THETA = np.array([2.5e5, 0.45, 2e-3, 0.5, 1.0])  # of launches
DRAW = [-0.38, -0.2]


def neo(theta: np.ndarray, **others: float | np.ndarray) -> Parameters:
    """Of the neo-Hookean law, of thetas (N, 5) or (5,)."""
    return Parameters.of(NEO_HOOKEAN, theta, **others)


def random_thetas(count: int, seed: int) -> np.ndarray:
    unit = np.random.default_rng(seed).uniform(size=(count, 5))
    theta = BOX[:, 0] + unit * (BOX[:, 1] - BOX[:, 0])
    for k in (0, 2):
        theta[:, k] = BOX[k, 0] * (BOX[k, 1] / BOX[k, 0]) ** unit[:, k]
    return theta


def random_draws(count: int, rng) -> np.ndarray:
    return np.column_stack([rng.uniform(-0.45, -0.33, count), rng.uniform(-0.3, -0.1, count)])


def along_x(sling, stretch: float = 1.0) -> np.ndarray:
    """A straight band's cross-sections (L, dofs), its middle at 0."""
    nodes = np.zeros((sling.sections, 3))
    nodes[:, 0] = stretch * (sling.arc - sling.rest_length / 2)
    return sections_of(sling, nodes)


def stepped(sling, steps, parameters, start, first_free=None, **lanes):
    """In double precision."""
    slings = Slings.of(sling, parameters, start, **lanes)
    schedule = Schedule(steps, len(steps) if first_free is None else first_free)
    return run(sling, schedule, slings, options=Options(double=True, tolerance=1e-10))


def at_rest(sling, parameters, start) -> np.ndarray:
    """Cross-sections (L, dofs) under gravity."""
    slings = Slings.of(sling, parameters, start)
    done = run(sling, Schedule(relaxation(Grip.FREE), 0), slings, options=Options(double=True))
    assert done.lanes["outcome"][0] == 0
    return done.state[0]
