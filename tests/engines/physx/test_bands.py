"""Bands in PhysX: the scene and the job on any machine, the motion where there are ovphysx and GPU.

SLING_PHYSX names the Python that has ovphysx.
"""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import gpus
from sling2sim2real.engines.physx import bands, rollouts, scene
from sling2sim2real.simulator.model import GRAVITY
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import NEO_HOOKEAN
from validation.engines import checks
from validation.engines.checks import THETA


def test_the_scene_has_each_band_with_its_material(tube):
    thetas = np.array([THETA, [1e5, 0.3, 1e-3, 0.5, 1.0]])
    text = scene.text(tube, thetas)
    assert text.count("def TetMesh") == text.count("def Material") == 2
    assert "youngsModulus = 220000\n" in text and "youngsModulus = 100000\n" in text
    assert f"mass = {tube.mass.sum():.9g}\n" in text
    assert text.count("(") == text.count(")") and text.count("{") == text.count("}")
    assert np.abs(np.diff(scene.offsets(40), axis=0)).max(axis=1).min() >= 1.0


def test_phases_lead_the_ends_into_the_clamps_and_the_hand_along_its_path(sling, tube):
    hang, held, free = rollouts.phases(tube, checks.episode_of(sling))
    ends = len(tube.ends)
    assert list(hang.vertices) == list(free.vertices) == list(held.vertices[:ends])
    assert hang.fade[-1] == pytest.approx(0) and not hang.keep
    assert hang.targets[-1] == pytest.approx(tube.clamped[[0, 1, -2, -1]].reshape(-1, 3))
    assert held.fade[-1] == 0 and len(held.targets) == 380 and held.keep and free.keep
    hand = held.targets[-1, ends:].mean(axis=0)
    assert list(held.vertices[ends:]) == list(tube.hand)
    assert hand[1:] == pytest.approx([-checks.DRAW, hand[2]], abs=1e-6)


def test_a_rollout_is_on_the_episodes_clock_and_a_burst_band_says_so(sling, tube):
    """Bands at rest, stretched to twice their length; the second is lost in flight."""
    episode = checks.episode_of(sling)
    thetas, across = np.array([THETA, THETA]), 0.74
    nodes = np.tile(tube.rest * [2.0, across, across], (480, 2, 1, 1, 1))
    nodes[400, 1, 5] = np.nan
    done = rollouts.rollouts(sling, tube, episode, thetas, nodes[:380], nodes[380:])
    assert done.failure == [None, bands.BURST] and np.isnan(done.force[1, 1:-2]).all()
    assert done.times[[0, -3]] == pytest.approx([episode.grasp_time - 0.005, episode.release_time])
    weight = tube.mass[tube.hand].sum() * GRAVITY  # both halves pull alike
    assert done.force[0, 1:-2] == pytest.approx(np.tile([0, 0, -weight], (380, 1)), abs=1e-6)
    assert not done.force[:, [0, -2, -1]].any()
    assert done.center_line.shape == (2, len(episode.cloud_time), len(sling.arc), 3)
    assert np.ptp(done.center_line[0, ..., 0], axis=1) == pytest.approx(2 * sling.rest_length)


def test_a_law_that_physx_lacks_is_refused(sling):
    with pytest.raises(UserError, match="no law rubber"):
        rollouts.simulate(replace(sling, law="rubber"), episode=None, parameters=None, device="cpu")


def test_without_physx_or_its_python_one_line_says_so(monkeypatch):
    monkeypatch.setenv(bands.INTERPRETER, "")  # this Python
    monkeypatch.setattr(bands, "ASK", bands.ASK.replace("ovstage", "no-such-engine"))
    with pytest.raises(UserError, match="no-such-engine.*pip install") as message:
        bands.release()
    assert "\n" not in str(message.value)
    monkeypatch.setenv(bands.INTERPRETER, "/not/there")
    with pytest.raises(UserError, match="SLING_PHYSX=/not/there: No such file"):
        bands.release()


def test_a_pull_holds_and_lets_go(sling):
    try:
        bands.release()
    except UserError as error:
        pytest.skip(str(error))
    if not gpus():
        pytest.skip("PhysX simulates deformable volumes on an NVIDIA GPU only")
    parameters = Parameters.of(NEO_HOOKEAN, THETA)
    plain, episode = replace(sling, law=NEO_HOOKEAN), checks.episode_of(sling)
    done = rollouts.simulate(plain, episode=episode, parameters=parameters, device="cuda:0")
    assert done.failure == [None] and np.linalg.norm(done.force[0, -3]) > 10
    after = episode.cloud_time > episode.release_time
    middle = done.center_line[0, after, len(sling.arc) // 2]
    speed = np.diff(middle, axis=0) / np.diff(episode.cloud_time[after])[:, None]
    assert np.linalg.norm(speed, axis=1).max() > 2
