"""Bands in PhysX: the scene and the job on any machine, the motion where there are ovphysx and GPU.

SLING_PHYSX names the Python that has ovphysx.
"""

from collections import Counter

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.base.machine import gpus
from pipeline.export.mesh import Tube
from pipeline.simulator.cylinder import volumes
from validation.engines import checks
from validation.engines.physx import bands, scene, study

THETA = np.array([2.2e5, 0.45, 3e-3, 1.0, 1.0])


@pytest.fixture(scope="module")
def sling(bench):
    return checks.sling_of(bench)


@pytest.fixture(scope="module")
def tube(sling):
    return Tube.of(sling, **checks.SAME_MESH)


def test_the_surface_is_closed_and_seen_from_outside(tube):
    faces = scene.surface(tube.tetrahedra)
    edges = Counter(
        edge for face in faces.tolist() for edge in zip(face, [*face[1:], face[0]], strict=True)
    )
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    corners = tube.rest.reshape(-1, 3)[faces]
    volume = np.linalg.det(corners).sum() / 6  # positive where faces look outwards
    assert volume == pytest.approx(volumes(tube.rest, tube.tetrahedra).sum())


def test_the_scene_has_each_band_with_its_material(tube):
    thetas = np.array([THETA, [1e5, 0.3, 1e-3, 0.5, 1.0]])
    text = scene.text(tube, thetas, 200, 64)
    assert text.count("def TetMesh") == text.count("def Material") == 2
    assert "youngsModulus = 220000\n" in text and "youngsModulus = 100000\n" in text
    assert f"mass = {tube.mass.sum():.9g}\n" in text
    assert text.count("(") == text.count(")") and text.count("{") == text.count("}")
    assert np.abs(np.diff(scene.offsets(40), axis=0)).max(axis=1).min() >= 1.0


def test_phases_lead_the_ends_into_the_clamps_and_the_hand_along_its_path(sling, tube):
    episode = checks.episode_of(sling)
    hang, held, free = study.phases(tube, episode, rate=200)
    rows = np.arange(tube.mass.size).reshape(tube.rest.shape[:2])
    assert set(hang.vertices) == set(rows[[0, 1, -2, -1]].ravel()) == set(free.vertices)
    assert set(held.vertices) - set(hang.vertices) == set(rows[tube.middle])
    ends = tube.clamped.reshape(-1, 3)[hang.vertices]
    assert hang.targets[-1] == pytest.approx(ends) and hang.fade[-1] == pytest.approx(0)
    assert held.fade[-1] == 0 and len(held.targets) == 380 == held.keep.sum()
    hand = held.targets[-1, -tube.rest.shape[1] :].mean(axis=0)
    assert hand[1:] == pytest.approx([-checks.DRAW, hand[2]], abs=1e-6)
    fine = study.phases(tube, episode, rate=1000)[1]
    assert fine.keep.sum() == 380
    assert fine.targets[fine.keep] == pytest.approx(held.targets, abs=1e-12)


def test_our_own_motion_compared_with_itself_differs_in_nothing(sling):
    episode = study._marked(checks.episode_of(sling))
    (motion,) = study.ours(sling, episode, THETA[None])
    assert len(motion.force) == 380 and len(motion.lines) == len(episode.cloud_time)
    assert motion.held > 10 and motion.recoil > 4
    for finding in study.compared("itself", motion, motion, limits=True):
        assert finding.met and finding.value == 0
    stiffer = study.BandMotion(1.03 * motion.force, motion.lines + 0.006)
    assert [finding.met for finding in study.compared("", motion, stiffer, limits=True)] == [
        False,
        False,
        True,
    ]


def test_without_physx_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setenv(bands.INTERPRETER, "")  # this Python
    monkeypatch.setattr(bands, "ASK", bands.ASK.replace("ovstage", "no-such-engine"))
    with pytest.raises(UserError, match="no-such-engine.*pip install") as message:
        bands.release()
    assert "\n" not in str(message.value)


def test_a_python_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setenv(bands.INTERPRETER, "/not/there")
    with pytest.raises(UserError, match="SLING_PHYSX=/not/there: No such file"):
        bands.release()


def test_a_pull_holds_and_lets_go(sling, tube):
    try:
        bands.release()
    except UserError as error:
        pytest.skip(str(error))
    if not gpus():
        pytest.skip("PhysX simulates deformable volumes on an NVIDIA GPU only")
    episode = checks.episode_of(sling)
    course = study.phases(tube, episode, 200)
    with bands.Engine() as engine:
        courses = engine.simulate(tube, THETA[None], course, rate=200, iterations=64)
    (motion,) = study.motions(tube, THETA[None], courses)
    assert motion.held > 10 and motion.recoil > 2
    assert study.balance(tube, THETA[None], courses)[0] < 10
