"""How long a hand drew and waited, by knots that are known."""

from dataclasses import replace

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.pull import EDGES, PARTS, launch_history
from tests.episode import led


def before(episode) -> tuple[float, float]:
    """Of a pull that never turns: when it last passes 5 and 95 % of its way."""
    held = episode.time <= episode.release_time
    time, place = episode.time[held], episode.position[held]
    way = place @ place[-1] / (place[-1] @ place[-1])
    first, last = (max([*time[way < edge], time[0]]) for edge in EDGES)
    pull_time = (last - first) / (PARTS[1] - PARTS[0])
    return pull_time, episode.release_time - last - (1 - PARTS[1]) * pull_time


@pytest.mark.parametrize("noise", [0.0, 2e-4])
def test_a_pull_that_never_turns_is_as_ever(noise) -> None:
    """To the last digit."""
    stop = ((1.2, 0.0), (3, 0.3), (4, 0.3), (6, 0.4), (7, 0.4))
    for knots in (led.MONOTONE, stop):
        episode = led.episode(knots, noise)
        history = launch_history(episode)
        assert (history["pull_time"], history["pause"]) == before(episode)


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


def test_a_hand_that_lets_go_at_the_fork_is_refused() -> None:
    episode = led.episode(led.MONOTONE)
    with pytest.raises(UserError, match="the hand lets go at the fork"):
        launch_history(replace(episode, position=0 * episode.position))


def test_the_deepest_draw_is_of_any_time() -> None:
    knots = ((1.2, 0.0), (3.2, 0.45), (5.2, 0.0), (8.2, 0.35), (9.2, 0.35))
    episode = led.episode(knots)
    assert launch_history(episode)["deepest"] == pytest.approx(0.45, abs=1e-3)
    assert launch_history(episode)["pull_time"] == pytest.approx(3, rel=0.1)
