"""Newton's numbers and loader: proven by a replay, and used with nothing of this project."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real import UserError, export
from sling2sim2real.exporting import mjcf, mujoco_replay
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import HOLD_LIMIT, LANDING_LIMIT
from sling2sim2real.exporting.newton_replay import NewtonReplay, loader, numbers
from sling2sim2real.simulator.launch import ballistic_landing
from sling2sim2real.simulator.model import GRAVITY
from tests.exporting import replayed
from tests.exporting.replayed import DRAW

pytest.importorskip("newton", reason="newton: pip install -e '.[export]'")


@pytest.fixture(scope="module")
def done(model, tmp_path_factory):
    return export(model, "newton", tmp_path_factory.mktemp("exports") / "toy", samples=5)


@pytest.fixture(scope="module")
def chain(model, done) -> SpringChain:
    return replayed.chain_of(model, done, step=done.card["time_step_s"])


def test_it_is_proven(model, done) -> None:
    assert done.card["engine"].startswith("Newton")
    replayed.assert_proven(model, done)


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


def test_samples_are_bands_of_their_own(model, done, monkeypatch) -> None:
    replayed.assert_samples(model, done)
    monkeypatch.syspath_prepend(done.folder)
    bands = replayed.loaded(done, monkeypatch)["bands"]
    ours = model.launches(DRAW, model.samples[:1])
    assert bands.draw([DRAW])[0] == pytest.approx(ours.hold_force[0], rel=HOLD_LIMIT)
    assert bands.launch()[0][0] == pytest.approx(ours.landing_y[0], rel=LANDING_LIMIT)


def test_another_band_would_be_noticed(model, chain) -> None:
    replayed.assert_another_would_be_noticed(model, chain, NewtonReplay)


def test_it_is_held_as_in_mujoco() -> None:
    """The loader imports nothing of the project, so that it has constants of its own."""
    module = loader()
    assert (module.SETTLE_S, module.BRAKE_PER_S, module.LONGEST_RECOIL_S) == (
        mujoco_replay.SETTLE_S, mujoco_replay.BRAKE_PER_S, mujoco_replay.LONGEST_RECOIL_S,
    )  # fmt: skip
    assert (module.HAND_MASS_KG, module.RIGID_HAND_N_PER_M, module.GRAVITY) == (
        mjcf.HAND_MASS_KG,
        mjcf.RIGID_HAND_N_PER_M,
        GRAVITY,
    )


@pytest.mark.parametrize("stiffness", [1.2e4, None])
def test_drawn_it_pulls_as_its_springs(chain, stiffness) -> None:
    """And the arm gives way, or does not."""
    chain = replace(chain, arm_stiffness=stiffness)
    bands = loader().SpringBands(numbers("toy", chain, []), count=2)
    held = bands.draw([DRAW, 0.9 * DRAW])
    middle = bands.lines[0, chain.edges // 2]
    expected = replayed.pull_of(chain, middle)
    assert bands.force[0] == pytest.approx(expected, abs=0.03)
    assert held[1] < held[0] == pytest.approx(np.linalg.norm(expected), rel=3e-3)
    way = np.linalg.norm(middle - [0, *DRAW])
    assert way == pytest.approx(held[0] / (stiffness or 1e6), rel=0.02)


def test_it_leaves_where_the_band_is_slack_and_flies_a_parabola(chain) -> None:
    bands = loader().SpringBands(numbers("toy", chain, []))
    bands.draw([DRAW])
    landing, left = bands.launch()
    slack = np.sqrt((chain.rest_length / 2) ** 2 - chain.half_width**2)
    y, z = slack * DRAW / np.linalg.norm(DRAW)
    expected = ballistic_landing(y, z, *left[0, 1:], chain.floor)
    assert landing[0] == pytest.approx(expected, rel=0.02)


def test_without_newton_it_is_refused(model, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "newton", None)
    monkeypatch.delitem(sys.modules, "sling2sim2real.exporting.newton_band", raising=False)
    monkeypatch.delattr("sling2sim2real.exporting.newton_band", raising=False)
    with pytest.raises(UserError, match=r"newton is not installed: pip install -e '.\[export"):
        export(model, "newton", tmp_path / "toy")
    assert list(tmp_path.iterdir()) == []
