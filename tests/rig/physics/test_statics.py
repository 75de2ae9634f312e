import numpy as np
import pytest

from rig.physics import string as dynamics
from rig.physics.world import bent_at, string_of

DRAW = np.array([0.0, -0.30, -0.15])


@pytest.mark.parametrize("length", [0.24, 0.54])
def test_a_held_band_rests_where_damped_motion_brings_it(coarse, monkeypatch, length) -> None:
    """Barely taut, and at the corner of the box."""
    string = string_of(coarse, "band1")
    at = bent_at(string, length * DRAW / np.linalg.norm(DRAW))
    memory = np.array([0.9, 0.9, 0.9])
    state = string.at_rest(at, 1e-6, held=True, memory=memory)
    monkeypatch.setattr(dynamics, "balanced", lambda *arguments: None)
    settled = string.at_rest(at, 1e-8, held=True, memory=memory)
    assert np.allclose(state, settled, atol=1e-6)
