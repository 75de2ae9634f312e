"""The fast tests in a project that somebody uses: own bands, an own lab, other methods and data."""

import sys

import pytest

from validation.projects import ProjectCopy, copy_project, run_of

pytestmark = pytest.mark.validation

MINE = {"source": "recording", "mass": 0.0408, "diameter": 0.012, "rest_length": 0.6}
SET = {
    **run_of({"orange": ["paper", "bo"]}, rig=False),
    "bands": {"orange": MINE},
    "rig.bands": {"orange": None},
    "setup.fork_width": 0.31,
    "setup.fork_height": 0.8,
    "setup.projectile_mass": 0.05,
    "setup.max_force": 60.0,
    "setup.draw_y": [-0.6, -0.3],
    "setup.base_to_fork": [0.5, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0],
    "sling.edges": 32,
    "optimizer.cma_rollouts": 3200,
    "policy.map_size": [65, 49],
}


def test_what_a_user_sets_turns_no_test_red(tmp_path) -> None:
    folder = tmp_path / "project"
    copy_project(folder)
    copy = ProjectCopy(folder, PYTHONPATH=str(folder))
    copy.set(SET)
    for file, text in {
        "data/launches/orange.csv": "draw_y,draw_z,error,landing,use\n-0.4,-0.2,,2,fit\n",
        "data/theta/orange-paper.json": "{}",
    }.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text)
    copy.commit()
    message = copy(sys.executable, "-m", "pytest", "-q", "-m", "not slow and not validation")
    assert " passed" in message and "failed" not in message
