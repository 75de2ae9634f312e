"""The comparison of both elements says what it should of each."""

import numpy as np
import pytest

from validation.simulator import elements


@pytest.fixture(scope="module")
def columns(bench):
    slings = elements.slings(bench.params)
    return {name: elements.measure(bench, slings[name], 2) for name in ("rod", "tetrahedra")}


def test_tetrahedra_lock_the_more_the_closer_nu_is_to_a_half(columns):
    """5.4 times at nu 0.45: known of meshes like the paper's. The rod does not lock."""
    assert columns["rod"].bending == pytest.approx(np.ones(3), rel=0.05)
    solid = columns["tetrahedra"].bending
    assert solid[0] > 2 and np.all(np.diff(solid) > 1)
    assert solid[1] == pytest.approx(5.4, rel=0.03)


def test_taut_both_say_nearly_the_same_and_the_rod_needs_less_memory(columns):
    rod, solid = columns.values()
    far = elements.compare(solid, rod)
    assert rod.pull == pytest.approx(np.ones(2), rel=5e-3)
    assert solid.pull == pytest.approx(np.ones(2), rel=0.02)
    assert 0 < far["launch speed, worst [%]"] < 2  # held sections and locking stiffen it
    assert 0 < far["peak force of the yardstick's pull [%]"] < 3
    assert far["centre line in the hand, rms [mm]"] < 10
    assert set(elements.compare(rod, rod).values()) == {0.0}
    assert rod.memory < solid.memory
    assert elements.failures(rod) == elements.failures(solid) == 0


def test_centre_lines_are_compared_at_the_same_places(columns):
    for column in columns.values():
        ends = column.lines[:, :, [0, -1]]
        assert ends == pytest.approx(np.broadcast_to(column.sling.tips, ends.shape), abs=1e-6)


def test_table_has_a_cell_for_every_element(columns):
    lines = elements.table(columns).splitlines()
    assert len(lines) > 15
    assert {line.count("|") for line in lines} == {4}
    assert "nan" not in "".join(lines)
