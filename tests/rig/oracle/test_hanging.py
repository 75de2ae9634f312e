"""How far the rig's bands hang with a weight."""

from dataclasses import replace

import numpy as np

from pipeline.base.weight import READINGS, tension
from rig.oracle.hanging import hanging_stretch
from rig.physics.world import string_of


def test_a_strand_hangs_further_the_more_it_carries_and_relaxes(params) -> None:
    string = string_of(params, "band1")

    def stretch(strands: int, string_i=string) -> float:
        return hanging_stretch(string_i, tension(strands)) or np.nan

    folded, single = map(stretch, READINGS)
    assert 1 < folded < single
    quick = replace(string.rubber, relaxation=np.array([[0.5, 1e-3]]))  # has forgotten it by then
    slow = replace(string.rubber, relaxation=np.array([[0.5, 1e6]]))  # carries it all still
    assert stretch(2, replace(string, rubber=slow)) < stretch(2, replace(string, rubber=quick))
    assert hanging_stretch(string, 1e6) is None
