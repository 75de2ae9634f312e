"""The replay against the rollout that it filters and samples."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from pipeline.layout import Layout
from pipeline.params import load
from pipeline.report.figures.simulation import replayed
from sling2sim2real.episode.episode import Episode
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import THETA as NAMES
from sling2sim2real.simulator.parameters import Parameters
from tests.project import DEFAULTS

pytestmark = pytest.mark.usefixtures("nowhere")

METHOD = "paper"
THETA = dict(zip(NAMES, (3e5, 0.46, 4e-3, 0.5, 0.6), strict=True))


@pytest.fixture(scope="module")
def params():
    return load(DEFAULTS)


@pytest.fixture(scope="module")
def sling(params):
    return ClampedBand.of(params.bands["band1"], params.setup, params.sling)


@pytest.fixture(scope="module")
def recorded(sling):
    """A hand that takes the hanging band at 1 s, draws it 0.3 m by 3 s and lets go at 4 s."""
    time = (np.arange(160) + 0.5) * 0.03
    knots = np.array([[0, 0, -0.2], [0, 0, -0.2], [0, 0, 0], [0, -0.3, 0], [0, -0.3, 0]])
    path = PchipInterpolator([0, 1, 2, 3, 5], knots)
    nothing, stamps = np.zeros((160, 3)), np.arange(20) * 0.24
    episode = Episode(
        "band1", time, path(time), path(time, 1), nothing + [0, 2, 0], 0 * time, stamps, [],
        1.0, 4.0, np.array([1.5, 0, 0]),
    )  # fmt: skip
    rollouts = interact(sling, episode, Parameters.of(sling.law, [*THETA.values()]))
    return episode, rollouts


@pytest.fixture(scope="module")
def played(params, recorded):
    episode, rollouts = recorded
    pair = params.run.pairs[f"band1-{METHOD}"]
    result = SimpleNamespace(band="band1", method=METHOD, theta={"theta": THETA}, pair=pair)
    run = SimpleNamespace(params=params, episodes={"band1": episode}, layout=Layout())
    return episode, rollouts, replayed(run, result)


def test_the_pause_keeps_the_force_and_nothing_pulls_before_or_after(played) -> None:
    episode, rollouts, played = played
    held = rollouts.force[0, np.searchsorted(rollouts.times, 3.7), 1]
    pause = (episode.time > 3.5) & (episode.time < 3.9)
    assert held > 3 and played.shape == (160, 3)
    np.testing.assert_allclose(played[pause, 1], held, rtol=0.01)
    free = (episode.time < 0.9) | (episode.time > 4.1)
    assert np.abs(played[free]).max() < 0.02 * held


def test_the_filter_does_not_delay_the_release(played) -> None:
    episode, _, played = played
    force = played[:, 1]
    half = force[episode.time < 3.9].max() / 2
    after = np.flatnonzero((force < half) & (episode.time > 3.5))[0]
    assert abs(episode.time[after] - 4.0) <= 0.03
