"""What Newton makes of the cable that we write: our mass, and a linear spring."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from pipeline.base.code import ROOT
from pipeline.base.errors import UserError
from pipeline.export.chain import SpringChain
from pipeline.simulator.model import GRAVITY
from validation.engines import newton_cable
from validation.engines.newton_cable import Cables, stage

RADIUS = 0.005
CHAIN = SpringChain(
    edges=20, rest_length=0.52, mass=0.023, half_width=0.06, floor=-0.9, projectile_mass=0.03,
    arm_stiffness=None, strength=11.0, mooney_share=0.0, upturn=0.0, damping_time=2e-3,
    largest_strain=1.0, step=1e-4,
)  # fmt: skip


@pytest.fixture
def imports():
    pytest.importorskip("newton", reason="newton: pip install -e '.[validation]'")
    pytest.importorskip("newton_usd_schemas", reason="newton's USD: pip install -e '.[validation]'")


def test_it_is_read_with_its_mass_and_stiffness(imports) -> None:
    place = np.array([0.0, -0.3, -0.1])
    bands = Cables([stage(CHAIN, RADIUS, place, held=False)], step=1e-4)
    masses, dofs = bands.model.body_mass.numpy(), bands.model.joint_qd_start.numpy()
    assert masses.sum() == pytest.approx(CHAIN.mass + CHAIN.projectile_mass, rel=1e-5)
    assert masses[bands.pouches] == pytest.approx([CHAIN.projectile_mass])
    assert len(bands.joints[0]) == CHAIN.edges - 1
    along = dofs[bands.joints[0]] + 2
    whole = 1 / (1 / bands.model.joint_target_ke.numpy()[along]).sum()
    assert whole == pytest.approx(CHAIN.strength / CHAIN.rest_length, rel=1e-4)
    damping = (
        bands.model.joint_target_kd.numpy()[along] / bands.model.joint_target_ke.numpy()[along]
    )
    assert damping == pytest.approx(np.full(len(along), CHAIN.damping_time), rel=1e-4)


@pytest.mark.slow
def test_it_is_held_as_a_linear_spring_and_leaves(imports, monkeypatch) -> None:
    places = np.array([[-0.3, -0.1], [-0.45, -0.15]])
    monkeypatch.setattr(newton_cable, "STEPS", 160)
    monkeypatch.setattr(newton_cable, "STEP", 5e-4)
    shots = newton_cable.launched(CHAIN, RADIUS, places)
    legs = CHAIN.tips - np.insert(places, 0, 0.0, axis=1)[:, None]
    lengths = np.linalg.norm(legs, axis=2, keepdims=True)
    pull = CHAIN.strength * (2 * lengths / CHAIN.rest_length - 1)
    weight = GRAVITY * (CHAIN.projectile_mass + CHAIN.mass / 2)
    expected = np.linalg.norm((pull * legs / lengths).sum(axis=1) - [0, 0, weight], axis=1)
    assert [shot.hold_force for shot in shots] == pytest.approx(expected, rel=0.01)
    strain = 2 * lengths[:, 0, 0] / CHAIN.rest_length - 1
    stored = CHAIN.strength * CHAIN.rest_length / 2 * strain**2
    share = np.array([shot.speed**2 for shot in shots]) * CHAIN.projectile_mass / 2 / stored
    assert ((share > 0.5) & (share < 1)).all()  # the rest is the band's, and damping's
    assert shots[0].landing < shots[1].landing
    tight = newton_cable.launched(replace(CHAIN, rest_length=0.44), RADIUS, places[:1])
    assert tight[0].hold_force > 1.2 * shots[0].hold_force


def test_without_newton_it_is_refused(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "newton", None)
    with pytest.raises(UserError, match=r"newton's USD import is not installed: pip install -e"):
        Cables([], step=1e-4)


def test_the_page_has_what_the_report_holds() -> None:
    content = json.loads((ROOT / newton_cable.REPORT).read_text("utf-8"))
    assert newton_cable.block(content) in (ROOT / newton_cable.PAGE).read_text("utf-8")
