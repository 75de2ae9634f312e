"""Splines held against finite differences, dense samples and the closed forms of a leg."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.cli.plan.trajectory import Phase, Trajectory

COORDINATE = st.floats(-1, 1).map(lambda x: round(x, 4))
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE).map(np.array)
PHASE = st.builds(
    Phase, st.sampled_from("abc"), POINT, st.floats(0.05, 5), st.sampled_from([0.0, 0.08])
)
TRAJECTORY = st.builds(
    Trajectory.through, POINT, st.just(0.08), st.lists(PHASE, min_size=1, max_size=5)
)


@given(trajectory=TRAJECTORY)
def test_smooth_to_the_second_derivative_and_at_rest_between_phases(trajectory) -> None:
    ends = [phase.to for phase in trajectory.phases]
    np.testing.assert_allclose(trajectory.position(trajectory.times[1:]), ends, atol=1e-14)
    path, knots = trajectory.path, trajectory.path.x[1:-1]
    for derivative in (0, 1, 2):
        coefficients = path.derivative(derivative).c if derivative else path.c
        widths = np.diff(path.x)[:-1, None]
        left = sum(c[:-1] * widths**k for k, c in enumerate(coefficients[::-1]))
        scale = 1 + trajectory.peaks(max(derivative, 1)).max()
        np.testing.assert_allclose(left, path(knots, derivative), atol=1e-9 * scale)
    for derivative in (1, 2):
        scale = 1 + trajectory.peaks(derivative).max()
        still = trajectory.position(trajectory.times, derivative)
        np.testing.assert_allclose(still, 0, atol=1e-9 * scale)


def test_fingers_and_names_by_time() -> None:
    still = np.zeros(3)
    phases = [Phase("wait", still, 1.0, 0.08), Phase("close", still, 0.5, 0.0)]
    both = Trajectory.through(still, 0.08, [*phases, Phase("rest", still, 1.0, 0.0)])
    np.testing.assert_allclose(both.opening([0.5, 1.0, 1.25, 1.5, 9.0]), [0.08, 0.08, 0.04, 0, 0])
    assert both.phase_at(np.array([0.0, 1.0, 1.4, 2.5])) == ["wait", "close", "close", "rest"]
    assert (both.start_of("close"), both.duration) == (1.0, 2.5)
    with pytest.raises(KeyError):
        both.start_of("fly")
