"""The recoil of a damped band against another model's: the virtual rig's string.

Both have Mooney and Rivlin's law and a viscous stress of s d times the rate of the elastic one,
which in the string is that of the stretch alone: what turns loses nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig.physics.elasticity import law_of
from rig.physics.rubber import Rubber
from rig.physics.string import ElasticString
from rig.physics.world import bent_at
from sling2sim2real.simulator.initial import drawn_guess
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.rubber import RUBBER
from validation.simulator.experiment import band_of, launched, move, settling
from validation.simulator.finding import Bench

DEPTH = 0.40  # m, of the draw
STEP, TIMES = 2.5e-4, np.arange(0.004, 0.0441, 0.004)  # s, after the release
SHARE, YOUNG = 0.5, 2.5e5  # Mooney's, Pa
pytestmark = pytest.mark.slow  # the string is compiled
LIMIT = 10.0  # mm, 2 % of the way that the middle goes


def string_like(sling: ClampedBand, eta: float, edges: int = 96) -> ElasticString:
    """The rig's string of a sling's band, shear modulus YOUNG / 3."""
    law = law_of("ogden", [1 - SHARE, 2.0, -SHARE, -2.0])
    tips = sling.half_width * np.array([[-1.0, 0, 0], [1.0, 0, 0]])
    return ElasticString(
        edges=edges,
        length=sling.rest_length,
        diameter=2 * sling.radius,
        mass=sling.mass,
        clamps=tips,
        clamp_direction=sling.clamp_direction,
        rubber=Rubber(YOUNG / 3, np.zeros((0, 2)), eta, law),
    )


def middles(bench: Bench, eta: float, turn_damping: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Of simulator and string at TIMES after a free release at DEPTH [m], shape (T, 3) each."""
    sling = replace(band_of(bench), law=RUBBER, air_density=1.2)
    drawn = np.array([0.0, -DEPTH, 0.0])
    string = string_like(sling, eta)
    y = string.at_rest(bent_at(string, drawn), 1e-6, held=True)
    truth = string.integrate(y, np.append(0.0, TIMES), 1e-6)[1][1:, string.middle, :3]
    before = settling(Grip.POUCH, drawn)
    table = np.concatenate([before, launched(STEP, int(np.ceil(TIMES[-1] / STEP)))])
    five = (YOUNG, 0.49, eta / 0.6, 0.5, 0.6)
    theta = Parameters.of(RUBBER, five, mooney_share=SHARE, turn_damping=turn_damping)
    motion = move(bench, sling, theta, table, drawn_guess(sling, drawn[None, 1:])[0], double=True)
    at = len(before) - 1 + np.rint(TIMES / STEP).astype(int)
    return motion.x[0, at, sling.middle, :3], truth


@pytest.mark.parametrize("eta", [0.002, 0.005])
def test_recoil_is_that_of_a_string_whose_turns_lose_nothing(bench, eta):
    """At every moment; where turns are braked it lags as no string does."""
    free, braked = (middles(bench, eta, share) for share in (0.0, 1.0))
    assert 1e3 * np.linalg.norm(np.subtract(*free), axis=1).max() < LIMIT
    assert 1e3 * np.linalg.norm(np.subtract(*braked), axis=1).max() > 2 * LIMIT
