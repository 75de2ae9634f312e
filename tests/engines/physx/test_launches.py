"""Launches in PhysX: a spring in place of its bands throws as far as the closed form says."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sling2sim2real.base.failures import DRAGGED, NEVER_LEFT, SLACK
from sling2sim2real.engines.physx import bands, launches, scene, worker
from sling2sim2real.engines.physx.bands import BURST
from sling2sim2real.simulator.model import GRAVITY
from validation.simulator.experiment import setup_of

DRAWS = np.array([[-0.34, -0.21], [-0.40, -0.15], [-0.30, -0.30]])
THETAS = np.array([[k, 0.45, 2e-3, 1.0, 1.0] for k in (80.0, 60.0, 120.0)])  # E: the spring's [N/m]
PROCESS = """
import sys, types
import numpy as np
sys.path.insert(0, {folder!r})
import worker

class Attached:
    def __init__(self, physx, path, number):
        job = np.load(path.parent / "job.npz")
        self.values = [job["rest"] + job["offsets"][:, None], np.zeros_like(job["start"])]
    def state(self):
        return [one.copy() for one in self.values]
    def write(self, which, values):
        if which < 2:
            self.values[which] = values.copy()
        else:  # what is led is there, and the rest stays
            self.values[0] = np.where(values[..., 3:] == 0, values[..., :3], self.values[0])
    def close(self):
        pass

worker.Attached = Attached
worker.start = lambda: types.SimpleNamespace(step_sync=lambda step: print("PhysX talks", end=""))
worker.main()
"""


@pytest.fixture(scope="module")
def launch_setup(bench):
    return replace(setup_of(bench), arm_stiffness=None)


@pytest.fixture
def engine(tmp_path, monkeypatch):
    """bands.Engine with a process in which nothing but the led nodes moves."""
    (tmp_path / "fake.py").write_text(PROCESS.format(folder=str(Path(worker.__file__).parent)))
    monkeypatch.setenv(bands.INTERPRETER, sys.executable)
    monkeypatch.setattr(bands, "release", lambda: "0")
    monkeypatch.setattr(worker, "__file__", str(tmp_path / "fake.py"))
    with bands.Engine() as engine:
        yield engine


@pytest.fixture
def springs(monkeypatch):
    """Bands pull the pouch to the fork's middle with E [N/m]."""

    def force_on(tube, sections, nodes, young, poisson):
        return -young[:, None] * nodes[:, sections[0]].mean(axis=1)

    monkeypatch.setattr(launches, "force_on", force_on)


def closed_form(setup, tube, stiffness: float, draw: np.ndarray) -> tuple[float, float, float]:
    """Landing [m], time and speed at the separation [s, m/s]."""
    mass = setup.projectile_mass + tube.mass[tube.hand].sum()
    pulse, ahead = np.sqrt(stiffness / mass), -draw / np.linalg.norm(draw)
    rest = np.array([0.0, -mass * GRAVITY / stiffness])
    phase = np.arccos(-(rest @ ahead) / ((draw - rest) @ ahead))
    y, z = rest + (draw - rest) * np.cos(phase)
    vy, vz = velocity = -pulse * (draw - rest) * np.sin(phase)
    flight = (vz + np.sqrt(vz**2 + 2 * GRAVITY * (z + setup.fork_height))) / GRAVITY
    return y + vy * flight, phase / pulse, np.linalg.norm(velocity)


def flown(sling, setup, tube, thetas, draws, spoil=lambda nodes, step: nodes):
    """As by an engine whose nodes are at the band's rest, but for the led ones."""
    flying = launches.Flight(sling, setup, tube, thetas, draws)
    targets, nodes = launches.led_to(tube, flying.place), np.tile(tube.rest, (len(draws), 1, 1, 1))
    for step in range(10_000):
        nodes[:, tube.middle] = targets[:, -tube.rest.shape[1] :]
        targets = flying(spoil(nodes.copy(), step))
        if targets is None:
            return flying.outcome()
        assert (targets[:, : len(tube.ends)] == tube.clamped.reshape(-1, 3)[tube.ends]).all()
    raise AssertionError("it never ended")


def test_springs_throw_as_far_as_the_closed_form_says(
    sling, launch_setup, tube, engine, springs, monkeypatch
):
    """By worker.py, job after job; leapfrog's error is (pulse x step)^2 / 24, and small."""
    for rate in (200, 1000):
        monkeypatch.setattr(launches, "STEPS_PER_S", rate)
        text = scene.text(tube, THETAS)
        done = launches.launched(engine, text, tube, THETAS, sling, launch_setup, DRAWS)
        assert done.failure == [None] * 3
        for i, (theta, draw) in enumerate(zip(THETAS, DRAWS, strict=True)):
            landing, time, speed = closed_form(launch_setup, tube, theta[0], draw)
            error = theta[0] / launch_setup.projectile_mass / rate**2 / 8
            assert done.landing_y[i] == pytest.approx(landing, rel=error)
            assert done.separation_time[i] == pytest.approx(time, rel=error)
            assert done.speed[i] == pytest.approx(speed, rel=error)
            assert done.hold_force[i] == pytest.approx(theta[0] * np.linalg.norm(draw))


def test_a_launch_that_does_not_land_says_why(sling, launch_setup, tube, springs):
    slack = np.array([[-0.12, -0.1]])
    assert flown(sling, launch_setup, tube, THETAS[:1], slack).failure == [SLACK]
    weak = THETAS[:1] * [1e-3, 1, 1, 1, 1]
    assert flown(sling, launch_setup, tube, weak, DRAWS[:1]).failure == [DRAGGED]
    high = replace(launch_setup, fork_height=50.0)
    assert flown(sling, high, tube, weak, DRAWS[:1]).failure == [NEVER_LEFT]


def test_a_band_that_bursts_leaves_the_others_as_they_are(sling, launch_setup, tube, springs):
    def spoil(nodes, step):
        if step >= 5:
            nodes[1, 3, 2] = np.nan if step % 2 else 1e9
        return nodes

    alone, done = (
        flown(sling, launch_setup, tube, THETAS, DRAWS, spoil=change)
        for change in (lambda n, _: n, spoil)
    )
    assert done.failure == [None, BURST, None]
    assert np.isnan(done.landing_y[1])
    assert (done.landing_y == alone.landing_y).tolist() == [True, False, True]
