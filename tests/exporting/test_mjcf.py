"""MuJoCo's XML: matched, proven by a replay, and used with nothing of this project."""

import json
import subprocess
import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from sling2sim2real import UserError, export
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import HOLD_LIMIT, LANDING_LIMIT
from sling2sim2real.exporting.mujoco_replay import MujocoBand
from tests.exporting import replayed
from tests.exporting.replayed import DRAW


@pytest.fixture(scope="module")
def done(model, tmp_path_factory):
    return export(model, "mjcf", tmp_path_factory.mktemp("exports") / "toy", samples=5)


@pytest.fixture(scope="module")
def chain(model, done) -> SpringChain:
    return replayed.chain_of(model, done)


def test_it_is_proven(model, done) -> None:
    replayed.assert_proven(model, done)


def test_what_its_card_says_runs_without_this_project(done, outside) -> None:
    """In a process that cannot import it, in the folder of the export."""
    code = (done.folder / "README.md").read_text().split("```python\n")[1].split("```")[0]
    command = [sys.executable, "-I", "-c", f"import sys; sys.path[:] = {outside}\n{code}"]
    run = subprocess.run(command, cwd=done.folder, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    force, landing = (float(line.split()[-2]) for line in run.stdout.splitlines())
    row = done.card["proof"][0]
    assert force == pytest.approx(row["hold_force_there_n"], rel=2e-3)
    assert landing == pytest.approx(row["landing_there_m"], rel=2e-3)


def test_samples_are_bands_of_their_own(model, done, chain, monkeypatch) -> None:
    replayed.assert_samples(model, done)
    replay = MujocoBand(chain)
    replay.model = replayed.loaded(done, monkeypatch)["model"]
    replay.data = mujoco.MjData(replay.model)
    shot, ours = replay.launch(DRAW), model.launches(DRAW, model.samples[:1])
    assert shot.hold_force == pytest.approx(ours.hold_force[0], rel=HOLD_LIMIT)
    assert shot.landing == pytest.approx(ours.landing_y[0], rel=LANDING_LIMIT)


def test_another_band_would_be_noticed(model, chain) -> None:
    replayed.assert_another_would_be_noticed(model, chain, MujocoBand)


def test_the_file_has_the_band_of_the_card(done, chain) -> None:
    model = mujoco.MjModel.from_xml_path(str(done.folder / "toy.xml"))
    card = json.loads((done.folder / "card.json").read_text())
    nodes = [model.body(f"node{i}").mass[0] for i in range(1, chain.edges)]
    assert sum(nodes) == pytest.approx(0.023 * (1 - 1 / chain.edges))
    assert model.body("projectile").mass[0] == pytest.approx(0.039)
    assert model.opt.timestep == card["time_step_s"]
    assert model.opt.gravity.tolist() == [0, 0, -9.81]
    assert [model.key(i).name for i in range(model.nkey)] == ["hanging", "draw1", "draw2", "draw3"]
    assert card["springs_error"] < 0.006 and card["time_step_error"] < 0.005


def test_drawn_it_pulls_as_its_springs_and_hanging_it_is_slack(chain) -> None:
    replay = MujocoBand(chain)
    replay.draw(DRAW)
    middle = replay.line[chain.edges // 2]
    expected = replayed.pull_of(chain, middle)
    assert replay.force == pytest.approx(expected, abs=0.03)
    way = np.linalg.norm(middle - [0, *DRAW])  # the arm gives way
    assert way == pytest.approx(np.linalg.norm(replay.force) / chain.arm_stiffness, rel=0.02)
    replay.hang()
    lengths = np.linalg.norm(np.diff(replay.line, axis=0), axis=1)
    assert lengths.max() < 1.02 * chain.spring_length
    assert np.abs(replay.data.qvel).max() < 1e-2


@pytest.mark.slow
def test_equal_bands_give_equal_bytes(model, done, tmp_path) -> None:
    again = export(model, "mjcf", tmp_path / "again", samples=5)
    for file in done.folder.iterdir():
        assert file.read_bytes() == (again.folder / file.name).read_bytes(), file.name


def test_a_band_that_cannot_be_matched_is_refused(model, tmp_path) -> None:
    weak = replace(model, settings=model.settings.changed(setup={"max_force": 0.5}))
    with pytest.raises(UserError, match="a match needs 4"):
        export(weak, "mjcf", tmp_path / "weak")
    assert list(tmp_path.iterdir()) == []
