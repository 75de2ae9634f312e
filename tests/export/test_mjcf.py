"""MuJoCo's XML: matched, proven by a replay, and used with nothing of this project."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from pipeline.export.card import HOLD, LANDING
from pipeline.export.chain import SpringChain
from pipeline.export.match import compared, draws_of, proof_draws
from pipeline.export.mujoco_replay import MujocoBand
from pipeline.export.proof import Matched
from sling2sim2real import UserError, export

mujoco = pytest.importorskip("mujoco", reason="mujoco: pip install -e '.[validation]'")


@pytest.fixture(scope="module")
def done(model, tmp_path_factory):
    return export(model, "mjcf", tmp_path_factory.mktemp("exports") / "toy")


@pytest.fixture(scope="module")
def chain(model, done) -> SpringChain:
    draws, ours = draws_of(model)
    start = SpringChain.of(model, draws, ours.hold_force)
    return replace(start, **{row["name"]: row["value"] for row in done.card["matched"]})


def test_it_is_proven_on_draws_that_took_no_part(model, done) -> None:
    assert done.met and done.card["met"]
    match = {(row["draw_y_m"], row["draw_z_m"]) for row in done.card["match"]}
    assert len(match) > 8 and len(done.card["proof"]) == 3
    for row in done.card["proof"]:
        draw = row["draw_y_m"], row["draw_z_m"]
        assert draw not in match
        ours = model.launches(draw)
        assert row["hold_force_n"] == pytest.approx(ours.hold_force[0], rel=1e-3)
        assert row["landing_there_m"] == pytest.approx(ours.landing_y[0], rel=LANDING)
        assert row["hold_force_there_n"] == pytest.approx(ours.hold_force[0], rel=HOLD)


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


def test_another_band_would_be_noticed(model, chain) -> None:
    """5 % more pull, or three times the damping, does not pass the proof."""
    draws = proof_draws(model)

    def met(chain: SpringChain) -> bool:
        proof = compared(model, draws, MujocoBand(chain).launches(draws))
        return Matched(chain, [], proof, None, 0.0, "").met

    assert met(chain)
    assert not met(replace(chain, strength=1.05 * chain.strength))
    assert not met(replace(chain, damping_time=3 * chain.damping_time))


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
    draw = np.array([-0.35, -0.15])
    replay.draw(draw)
    middle = replay.line[chain.edges // 2]
    legs = chain.tips - middle
    lengths = np.linalg.norm(legs, axis=1, keepdims=True)
    pull = chain.pull(2 * lengths / chain.rest_length - 1)
    weight = (chain.mass / 2 + chain.projectile_mass) * 9.81
    expected = (pull * legs / lengths).sum(axis=0) - [0, 0, weight]
    assert replay.force == pytest.approx(expected, abs=0.03)
    way = np.linalg.norm(middle - [0, *draw])  # the arm gives way
    assert way == pytest.approx(np.linalg.norm(replay.force) / chain.arm_stiffness, rel=0.02)
    replay.hang()
    lengths = np.linalg.norm(np.diff(replay.line, axis=0), axis=1)
    assert lengths.max() < 1.02 * chain.spring_length
    assert np.abs(replay.data.qvel).max() < 1e-2


def test_the_pull_is_near_ours(done) -> None:
    pull = done.card["pull"]
    assert pull["force_rms"] < 0.05 * pull["peak"]
    assert abs(pull["hold"]) < 0.03
    assert pull["taut_rms"] < 0.01


def test_equal_bands_give_equal_bytes(model, done, tmp_path) -> None:
    again = export(model, "mjcf", tmp_path / "again")
    for file in done.folder.iterdir():
        assert file.read_bytes() == (again.folder / file.name).read_bytes(), file.name


def test_a_band_that_cannot_be_matched_is_refused(model, tmp_path) -> None:
    weak = replace(model, settings=model.settings.changed(setup={"max_force": 0.5}))
    with pytest.raises(UserError, match="a match needs 4"):
        export(weak, "mjcf", tmp_path / "weak")
    assert list(tmp_path.iterdir()) == []
