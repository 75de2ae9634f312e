"""How long a hand drew and waited, by knots that are known."""

import pytest

from sling2sim2real.episode.pull import launch_history
from tests.episode import led


@pytest.mark.parametrize(
    ("knots", "pull_time", "pause"),
    [
        (led.DIP, 4.0, 2.0),
        (led.FAST, 4.0, 2.0),
        (led.ON_THE_WAY, 3.3, 1.5),
        (led.CYCLES, 3.0, 2.0),
        ((*led.DIP[:-1], (8.2, 0.25), (9.2, 0.4), (10.7, 0.4)), 4.0, 1.5),  # two dips
        (((1.2, 0.0), (4.2, 0.4), (5.2, 0.35), (7.2, 0.35)), 2.5, 2.0),  # let go less drawn
    ],
)
def test_dips_and_cycles(knots, pull_time, pause) -> None:
    history = launch_history(led.episode(knots, 2e-4))
    assert history["pull_time"] == pytest.approx(pull_time, rel=0.1)
    assert history["pause"] == pytest.approx(pause, abs=0.1)
    assert history["deepest"] == pytest.approx(0.4, abs=2e-3)


def test_the_deepest_draw_is_of_any_time() -> None:
    knots = ((1.2, 0.0), (3.2, 0.45), (5.2, 0.0), (8.2, 0.35), (9.2, 0.35))
    episode = led.episode(knots)
    assert launch_history(episode)["deepest"] == pytest.approx(0.45, abs=1e-3)
    assert launch_history(episode)["pull_time"] == pytest.approx(3, rel=0.1)
