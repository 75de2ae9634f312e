"""Newton's numbers and loader: proven by a replay, and used with nothing of this project."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from pipeline.export import mjcf, mujoco_replay
from pipeline.export.card import HOLD, LANDING
from pipeline.export.chain import SpringChain
from pipeline.export.match import compared, draws_of, proof_draws
from pipeline.export.newton_replay import NewtonReplay, loader, numbers
from pipeline.export.proof import Matched
from pipeline.simulator.launch import ballistic_landing
from pipeline.simulator.model import GRAVITY
from sling2sim2real import UserError, export

pytest.importorskip("newton", reason="newton: pip install -e '.[export]'")
pytest.importorskip("mujoco", reason="mujoco: pip install -e '.[export]'")


@pytest.fixture(scope="module")
def done(model, tmp_path_factory):
    return export(model, "newton", tmp_path_factory.mktemp("exports") / "toy")


@pytest.fixture(scope="module")
def chain(model, done) -> SpringChain:
    draws, ours = draws_of(model)
    start = SpringChain.of(model, draws, ours.hold_force)
    matched = {row["name"]: row["value"] for row in done.card["matched"]}
    return replace(start, step=done.card["time_step_s"], **matched)


def test_it_is_proven_on_draws_that_took_no_part(model, done) -> None:
    assert done.met and done.card["met"] and done.card["engine"].startswith("Newton")
    match = {(row["draw_y_m"], row["draw_z_m"]) for row in done.card["match"]}
    assert len(match) > 8 and len(done.card["proof"]) == 3
    assert done.card["time_step_error"] < 0.005
    for row in done.card["proof"]:
        draw = row["draw_y_m"], row["draw_z_m"]
        assert draw not in match
        ours = model.launches(draw)
        assert row["landing_there_m"] == pytest.approx(ours.landing_y[0], rel=LANDING)
        assert row["hold_force_there_n"] == pytest.approx(ours.hold_force[0], rel=HOLD)


def test_what_its_card_says_runs_without_this_project(done, outside) -> None:
    """In a process that cannot import it, in the folder of the export."""
    code = (done.folder / "README.md").read_text().split("```python\n")[1].split("```")[0]
    start = f"import sys; sys.path[:] = ['.', *{outside}]\n"
    command = [sys.executable, "-I", "-c", start + code]
    run = subprocess.run(command, cwd=done.folder, capture_output=True, text=True, timeout=240)
    assert run.returncode == 0, run.stderr
    lines = [line.split() for line in run.stdout.splitlines()]
    forces, landings = (
        [float(words[-2]) for words in lines if words[0] == first] for first in ("hold", "landing")
    )
    rows = done.card["proof"]
    assert forces == pytest.approx([row["hold_force_there_n"] for row in rows], abs=0.006)
    assert landings == pytest.approx([row["landing_there_m"] for row in rows], rel=2e-3)


def test_another_band_would_be_noticed(model, chain) -> None:
    """5 % more pull, or three times the damping, does not pass the proof."""
    draws = proof_draws(model)

    def met(chain: SpringChain) -> bool:
        proof = compared(model, draws, NewtonReplay(chain).launches(draws))
        return Matched(chain, [], proof, None, 0.0, "").met

    assert met(chain)
    assert not met(replace(chain, strength=1.05 * chain.strength))
    assert not met(replace(chain, damping_time=3 * chain.damping_time))


def test_it_is_held_as_in_mujoco() -> None:
    """The loader imports nothing of the project, so that it has constants of its own."""
    module = loader()
    assert (module.SETTLE, module.BRAKE, module.LONGEST) == (
        mujoco_replay.SETTLE, mujoco_replay.BRAKE, mujoco_replay.LONGEST,
    )  # fmt: skip
    assert (module.HAND_MASS, module.STIFF, module.GRAVITY) == (mjcf.HAND_MASS, mjcf.STIFF, GRAVITY)


@pytest.mark.parametrize("stiffness", [1.2e4, None])
def test_drawn_it_pulls_as_its_springs(chain, stiffness) -> None:
    """And the arm gives way, or does not."""
    chain = replace(chain, arm_stiffness=stiffness)
    draw = np.array([-0.35, -0.15])
    bands = loader().SpringBands(numbers("toy", chain, []), count=2)
    held = bands.draw([draw, 0.9 * draw])
    middle = bands.lines[0, chain.edges // 2]
    legs = chain.tips - middle
    lengths = np.linalg.norm(legs, axis=1, keepdims=True)
    pull = chain.pull(2 * lengths / chain.rest_length - 1)
    weight = (chain.mass / 2 + chain.projectile_mass) * 9.81
    expected = (pull * legs / lengths).sum(axis=0) - [0, 0, weight]
    assert bands.force[0] == pytest.approx(expected, abs=0.03)
    assert held[1] < held[0] == pytest.approx(np.linalg.norm(expected), rel=3e-3)
    way = np.linalg.norm(middle - [0, *draw])
    assert way == pytest.approx(held[0] / (stiffness or 1e6), rel=0.02)


def test_it_leaves_where_the_band_is_slack_and_flies_a_parabola(chain) -> None:
    bands, draw = loader().SpringBands(numbers("toy", chain, [])), np.array([-0.35, -0.15])
    bands.draw([draw])
    landing, left = bands.launch()
    slack = np.sqrt((chain.rest_length / 2) ** 2 - chain.half_width**2)
    y, z = slack * draw / np.linalg.norm(draw)
    expected = ballistic_landing(y, z, *left[0, 1:], chain.floor)
    assert landing[0] == pytest.approx(expected, rel=0.02)


def test_the_pull_is_near_ours(done) -> None:
    pull = done.card["pull"]
    assert pull["force_rms"] < 0.05 * pull["peak"]
    assert abs(pull["hold"]) < 0.03
    assert pull["taut_rms"] < 0.01


def test_without_newton_it_is_refused(model, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "newton", None)
    monkeypatch.delitem(sys.modules, "pipeline.export.newton_band", raising=False)
    monkeypatch.delattr("pipeline.export.newton_band", raising=False)
    with pytest.raises(UserError, match=r"newton is not installed: pip install -e '.\[export"):
        export(model, "newton", tmp_path / "toy")
    assert list(tmp_path.iterdir()) == []
