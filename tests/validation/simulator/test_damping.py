"""No rates gain energy."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.simulator.parameters import Parameters
from validation.simulator import damping
from validation.simulator.agreement import random_thetas
from validation.simulator.damping import STATES
from validation.simulator.experiment import band_of
from validation.simulator.finding import Bench
from validation.simulator.reference import ReferenceRod

ROUNDING = 1e-9  # of the largest power


def power_gain(rod: ReferenceRod, sections: np.ndarray) -> float:
    """Most power that any rates gain in a state (L, 9); each degree of freedom alone loses 1.

    Dissipation is a quadratic form of the rates: its lowest eigenvalue, the diagonal scaled to 1.
    """
    size = sections.size
    rates = np.eye(size).reshape(size, *sections.shape)
    form = rod.viscous(rates, np.broadcast_to(sections, rates.shape)).reshape(size, size)
    diagonal = np.abs(np.diag(form))
    moves = diagonal > 0
    scale = np.sqrt(np.outer(diagonal[moves], diagonal[moves]))
    lowest = np.linalg.eigvalsh(form[moves][:, moves] / scale)[0]
    return float(max(-lowest, 0.0))


def test_no_rates_gain_energy_in_random_states(bench: Bench):
    @given(
        st.sampled_from(sorted(STATES)), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.5, 1.0])
    )
    def gains_nothing(kind: str, seed: int, share: float) -> None:
        rng = np.random.default_rng(seed)
        sling = band_of(bench)
        sections = damping.random_states(sling, kind, 1, rng)[0]
        theta = Parameters.of(sling.law, random_thetas(bench, 1, seed), turn_damping=share)
        assert power_gain(ReferenceRod(sling, theta), sections) <= ROUNDING

    gains_nothing()
