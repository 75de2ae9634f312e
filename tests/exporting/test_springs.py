"""Exports as springs: matched, proven by a replay in their engine, used without this project."""

import subprocess
import sys
from dataclasses import replace

import mujoco
import numpy as np
import pandas as pd
import pytest

from sling2sim2real import UserError, export
from sling2sim2real.exporting import mjcf, mujoco_replay
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import (
    HOLD_LIMIT,
    LANDING_LIMIT,
    Matched,
    compared,
    draws_of,
    proof_draws,
)
from sling2sim2real.exporting.mujoco_replay import MujocoBand
from sling2sim2real.exporting.newton_replay import NewtonReplay, loader, numbers
from sling2sim2real.simulator.launch import ballistic_landing
from sling2sim2real.simulator.model import GRAVITY

DRAW = np.array([-0.35, -0.15])
REPLAYS = {"mjcf": MujocoBand, "newton": NewtonReplay}
NEWTON = "newton: pip install -e '.[export]'"


@pytest.fixture(scope="module", params=REPLAYS)
def target(request) -> str:
    if request.param == "newton":
        pytest.importorskip("newton", reason=NEWTON)
    return request.param


@pytest.fixture(scope="module")
def done(model, target, tmp_path_factory):
    return export(model, target, tmp_path_factory.mktemp("exports") / "toy", samples=5)


@pytest.fixture(scope="module")
def chain(model, done) -> SpringChain:
    """As it was matched."""
    draws, ours = draws_of(model)
    matched = {row["name"]: row["value"] for row in done.card["matched"]}
    start = SpringChain.of(model, draws, ours.hold_force)
    return replace(start, **matched, step=done.card["time_step_s"])


def pull_of(chain: SpringChain, middle: np.ndarray) -> np.ndarray:
    """Of two straight legs to `middle`, and of the weight there [N], shape (3,)."""
    legs = chain.tips - middle
    lengths = np.linalg.norm(legs, axis=1, keepdims=True)
    pull = chain.pull(2 * lengths / chain.rest_length - 1)
    weight = (chain.mass / 2 + chain.projectile_mass) * 9.81
    return (pull * legs / lengths).sum(axis=0) - [0, 0, weight]


def test_it_is_proven_on_draws_that_took_no_part_in_the_match(model, done) -> None:
    assert done.met and done.card["met"]
    match = {(row["draw_y_m"], row["draw_z_m"]) for row in done.card["match"]}
    assert len(match) > 8 and len(done.card["proof"]) == 3
    assert done.card["time_step_error"] < 0.005 and done.card.get("springs_error", 0.0) < 0.006
    for row in done.card["proof"]:
        draw = row["draw_y_m"], row["draw_z_m"]
        assert draw not in match
        ours = model.launches(draw)
        assert row["hold_force_n"] == pytest.approx(ours.hold_force[0], rel=1e-3)
        assert row["landing_there_m"] == pytest.approx(ours.landing_y[0], rel=LANDING_LIMIT)
        assert row["hold_force_there_n"] == pytest.approx(ours.hold_force[0], rel=HOLD_LIMIT)


def test_another_band_would_be_noticed(model, target, chain) -> None:
    """5 % more pull, or three times the damping, does not pass the proof."""
    draws = proof_draws(model)

    def met(chain: SpringChain) -> bool:
        proof = compared(model, draws, REPLAYS[target](chain).launches(draws))
        return Matched(chain, [], proof, 0.0, "").met

    assert met(chain)
    assert not met(replace(chain, strength=1.05 * chain.strength))
    assert not met(replace(chain, damping_time=3 * chain.damping_time))


def test_what_its_card_says_runs_without_this_project(done, outside) -> None:
    """In a process that cannot import it, in the folder of the export."""
    code = (done.folder / "README.md").read_text().split("```python\n")[1].split("```")[0]
    start = f"import sys; sys.path[:] = ['.', *{outside}]\n"
    command = [sys.executable, "-I", "-c", start + code]
    run = subprocess.run(command, cwd=done.folder, capture_output=True, text=True, timeout=240)
    assert run.returncode == 0, run.stderr
    lines = [line.split() for line in run.stdout.splitlines()]
    for word, name in (("hold", "hold_force_there_n"), ("landing", "landing_there_m")):
        seen = [float(words[-2]) for words in lines if words[0] == word]
        expected = [row[name] for row in done.card["proof"][: len(seen)]]
        assert seen and seen == pytest.approx(expected, rel=2e-3, abs=0.006)


def test_samples_are_bands_of_their_own(model, target, done, chain, monkeypatch) -> None:
    """They hold and land as the calibrated simulation of theirs, and not as the best θ."""
    told, table = done.card["samples"], pd.read_parquet(done.folder / "samples.parquet")
    assert told["met"] and (told["count"], len(told["replayed"])) == (5, 3)
    assert {told["replayed"][0]["sample"], told["replayed"][-1]["sample"]} == {0, 2}
    names = [f"theta_{name}" for name in model.sampled.names]
    np.testing.assert_allclose(table[names], model.samples, rtol=1e-9)
    ours = model.launches(np.tile(DRAW, (5, 1)), model.samples)
    assert np.ptp(ours.hold_force) > 5 * HOLD_LIMIT * ours.hold_force.mean()
    assert np.ptp(ours.landing_y) > 5 * LANDING_LIMIT * ours.landing_y.mean()

    monkeypatch.chdir(done.folder)
    monkeypatch.syspath_prepend(done.folder)
    code = (done.folder / "README.md").read_text().split("```python\n")[2].split("```")[0]
    loaded: dict = {}
    exec(code, loaded)  # the card's second example: a band of the first sample
    if target == "mjcf":
        replay = MujocoBand(chain)
        replay.model, replay.data = loaded["model"], mujoco.MjData(loaded["model"])
        shot = replay.launch(DRAW)
        seen = shot.hold_force, shot.landing
    else:
        seen = loaded["bands"].draw([DRAW])[0], loaded["bands"].launch()[0][0]
    assert seen[0] == pytest.approx(ours.hold_force[0], rel=HOLD_LIMIT)
    assert seen[1] == pytest.approx(ours.landing_y[0], rel=LANDING_LIMIT)


@pytest.mark.parametrize("stiffness", [1.2e4, None])
def test_drawn_it_pulls_as_its_springs(target, chain, stiffness) -> None:
    """And the arm gives way, or does not by what could be seen."""
    chain = replace(chain, arm_stiffness=stiffness)
    if target == "mjcf":
        replay = MujocoBand(chain)
        replay.draw(DRAW)
        line, force = replay.line, replay.force
    else:
        bands = loader().SpringBands(numbers("toy", chain, []), count=2)
        held = bands.draw([DRAW, 0.9 * DRAW])
        line, force = bands.lines[0], bands.force[0]
        assert held[1] < held[0] == pytest.approx(np.linalg.norm(force), rel=3e-3)
    middle = line[chain.edges // 2]
    assert force == pytest.approx(pull_of(chain, middle), abs=0.03)
    way = np.linalg.norm(middle - [0, *DRAW])
    rounding = 2e-6 if target == "mjcf" else 0.0  # m, of where MuJoCo's hand comes to rest
    expected = np.linalg.norm(force) / (stiffness or mjcf.RIGID_HAND_N_PER_M)
    assert way == pytest.approx(expected, rel=0.02, abs=rounding)


def test_in_mujoco_the_band_of_the_card_hangs_slack(target, done, chain) -> None:
    if target != "mjcf":
        pytest.skip("another engine")
    model = mujoco.MjModel.from_xml_path(str(done.folder / "toy.xml"))
    nodes = [model.body(f"node{i}").mass[0] for i in range(1, chain.edges)]
    assert sum(nodes) == pytest.approx(0.023 * (1 - 1 / chain.edges))
    assert model.body("projectile").mass[0] == pytest.approx(0.039)
    assert model.opt.timestep == chain.step
    assert [model.key(i).name for i in range(model.nkey)] == ["hanging", "draw1", "draw2", "draw3"]
    replay = MujocoBand(chain)
    replay.hang()
    lengths = np.linalg.norm(np.diff(replay.line, axis=0), axis=1)
    assert lengths.max() < 1.02 * chain.spring_length
    assert np.abs(replay.data.qvel).max() < 1e-2


def test_in_newton_it_is_held_as_in_mujoco_and_leaves_where_the_band_is_slack(
    target, chain
) -> None:
    """The loader imports nothing of the project, so that it has constants of its own."""
    if target != "newton":
        pytest.skip("another engine")
    for name, module in {
        "SETTLE_S": mujoco_replay,
        "BRAKE_PER_S": mujoco_replay,
        "LONGEST_RECOIL_S": mujoco_replay,
        "HAND_MASS_KG": mjcf,
        "RIGID_HAND_N_PER_M": mjcf,
    }.items():
        assert getattr(loader(), name) == getattr(module, name)
    assert loader().GRAVITY == GRAVITY
    bands = loader().SpringBands(numbers("toy", chain, []))
    bands.draw([DRAW])
    landing, left = bands.launch()
    slack = np.sqrt((chain.rest_length / 2) ** 2 - chain.half_width**2)
    y, z = slack * DRAW / np.linalg.norm(DRAW)
    expected = ballistic_landing(y, z, *left[0, 1:], chain.floor)
    assert landing[0] == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_equal_bands_give_equal_bytes(model, target, done, tmp_path) -> None:
    again = export(model, target, tmp_path / "again", samples=5)
    for file in done.folder.iterdir():
        assert file.read_bytes() == (again.folder / file.name).read_bytes(), file.name


def test_a_band_that_cannot_be_matched_is_refused(model, tmp_path) -> None:
    weak = replace(model, settings=model.settings.changed(setup={"max_force": 0.5}))
    with pytest.raises(UserError, match="a match needs 4"):
        export(weak, "mjcf", tmp_path / "weak")
    assert list(tmp_path.iterdir()) == []
