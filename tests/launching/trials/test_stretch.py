"""How far a band is stretched."""

import numpy as np
import pytest

from sling2sim2real.episode.episode import Episode
from sling2sim2real.launching.trials.stretch import recorded_stretch, stretch_of


def test_stretch_of_a_345_triangle() -> None:
    """Tips 6 apart, drawn 4 back: two sides of length 5, whatever the direction of the draw."""
    points = np.array([[0, -4, 0], [0, 0, -4], [0, -2.4, -3.2]])
    np.testing.assert_allclose(stretch_of(points, 6.0, 8.0), 10 / 8)
    assert stretch_of(np.array([[3.0, 0, 0]]), 6.0, 8.0)[0] == pytest.approx(6 / 8)


def test_the_recorded_stretch_counts_only_while_the_band_is_held() -> None:
    time = np.arange(5.0)
    position = np.array([[0, -9, 0], [0, 0, 0], [0, -4, 0], [0, -1, 0], [0, -9, 0]], float)
    nothing = np.zeros((5, 3))
    episode = Episode(
        "toy", time, position, nothing, nothing, time, time, [], 1.0, 3.0, np.zeros(3)
    )
    assert recorded_stretch([episode], 6.0, 8.0) == pytest.approx(10 / 8)
