"""Recordings whose hand lets the drawn band back, or draws it several times, and takes longer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.phases import phases
from sling2sim2real.recording.build import episode_of, process_recording
from sling2sim2real.recording.events import find_release, find_releases
from tests.project import with_
from tests.recording.conftest import written
from validation.recordings.bag import Truth

KNOTS = {
    "dip": ((1.0, 0.0), (2.2, 0.38), (2.7, 0.28), (3.2, 0.38), (4.3, 0.38)),
    "fast": ((1.0, 0.0), (2.2, 0.38), (2.45, 0.28), (2.7, 0.38), (3.2, 0.38)),
    "cycles": (
        (1.0, 0.0), (1.8, 0.38), (2.6, 0.0), (3.4, 0.38), (4.2, 0.0), (5.2, 0.38), (6.4, 0.38)
    ),
}  # fmt: skip
EXPECTED = {
    "dip": "loading unloading reloading pause recoil swing",
    "fast": "loading unloading reloading pause recoil swing",
    "cycles": "loading unloading reloading unloading reloading pause recoil swing",
}
ASIDE = {"rate", "pause"}  # as the recordings are made


@dataclass(frozen=True)
class Led(Truth):
    """The hand goes from knot to knot of time and drawn distance, and lets go at the last."""

    draw: float = 0.0
    knots: tuple[tuple[float, float], ...] = ()

    def hand(self, t: float) -> np.ndarray:
        way = 0.0
        for (begin, low), (end, high) in zip(self.knots[:-1], self.knots[1:], strict=True):
            part = min(max((t - begin) / (end - begin), 0.0), 1.0)
            way += (high - low) * part**2 * (3 - 2 * part)
        return super().hand(t) - [0.0, way, 0.0]


def led(name: str) -> Led:
    release = KNOTS[name][-1][0] + 4e-4
    return Led(knots=KNOTS[name], drawn=KNOTS[name][-2][0], release=release, end=release + 1.2)


LONG = pytest.param("cycles", marks=pytest.mark.slow)


@pytest.fixture(scope="session", params=["dip", "fast", LONG])
def done(request, params, tmp_path_factory):
    """(name, truth, the one pull that is in it); to be read only."""
    path, truth = written(tmp_path_factory, f"{request.param}.mcap", truth=led(request.param))
    usable, refused = process_recording(path, params.bands["band1"], params)
    assert not refused
    (pull,) = usable
    return request.param, truth, pull


def test_no_check_takes_a_dip_for_a_fault(done) -> None:
    findings = [
        finding for finding in done[2].findings if "it swings" not in finding.what
    ]  # as it is made
    assert {finding.about for finding in findings} <= ASIDE


def test_it_is_one_pull_whose_events_are_found(done) -> None:
    _, truth, pull = done
    signals = pull.signals
    assert pull.whole.start + signals.release_time == pytest.approx(truth.release, abs=1e-3)
    assert pull.whole.start + signals.grasp_time == pytest.approx(truth.grasp, abs=0.021)
    assert not signals.facts.slips


def test_the_window_follows_the_interaction(done, params) -> None:
    name, truth, pull = done
    signals, usual = pull.signals, params.episode
    period = usual.duration / usual.samples
    assert np.diff(signals.time) == pytest.approx(period)
    needed = truth.release + usual.tail - truth.grasp
    if name == "fast":
        assert len(signals.time) == usual.samples
    else:
        assert usual.samples < len(signals.time) <= (needed + 0.5) / period + 2
    assert len(pull.view.times) == pytest.approx(15 * signals.duration, abs=2)
    episode = episode_of(pull, "band1")
    assert [phase.kind for phase in phases(episode)] == EXPECTED[name].split()
    hand = np.array([truth.hand(pull.whole.start + time) for time in episode.time])
    np.testing.assert_allclose(episode.position, hand, atol=1e-3)


def test_beyond_the_longest_it_is_refused_in_one_line(done, params) -> None:
    short = with_(params, "episode", longest=3.6, duration=3.6, samples=120, tail=0.5)
    path = done[2].part.recording.path
    if done[0] == "fast":
        return
    with pytest.raises(UserError, match=r"more than episode.longest 3.6 s .* fewer cycles"):
        process_recording(path, short.bands["band1"], short)


@pytest.mark.parametrize("leg", [0.1, 0.15, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("depth", [0.05, 0.1, 0.2])
def test_no_dip_that_an_arm_can_do_is_a_release(leg, depth) -> None:
    """Down to 0.1 s each way, which takes 60 m/s^2 for 10 cm."""
    low, again = 3.0 + leg, 3.0 + 2 * leg
    knots = (
        (1.0, 0.0),
        (2.5, 0.38),
        (3.0, 0.38),
        (low, 0.38 - depth),
        (again, 0.38),
        (again + 1, 0.38),
    )
    truth = Led(knots=knots, release=again + 1)
    time = np.arange(0, truth.release + 1, 1e-3)
    force = np.array([truth.force(t) for t in time])
    force += np.random.default_rng(0).normal(0, 0.04, force.shape)
    release = find_release(time, force)
    assert release.time == pytest.approx(truth.release, abs=2e-3)
    assert len(find_releases(time, force, None)) == 1
