"""A search in PhysX: its results stay where launches fail; who threw what stands in its place."""

import json
import sys
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.simulator.parameters import Parameters
from tests.project import DEFAULTS
from validation.engines.physx import search
from validation.engines.physx.search import OURS, PHYSX

THETAS = np.array([[2.2e5, 0.45, 3e-3, 1.0, 1.0], [1.8e5, 0.40, 2e-3, 1.0, 1.0]])


@pytest.fixture
def searched(tmp_path, monkeypatch):
    """search.main without the searches, whose best are THETAS; returns the file's path."""

    def fake_search(self, engine):
        best = dict(zip(self.box.names, THETAS[(OURS, PHYSX).index(engine)], strict=True))
        return SimpleNamespace(best_row=lambda: best, total=np.array([1.0, np.inf])), 2.0

    monkeypatch.setattr(search.Comparison, "search", fake_search)
    monkeypatch.setattr(search.Comparison, "losses", lambda self, thetas: {})
    monkeypatch.setattr(search, "release", lambda: "0")
    monkeypatch.setattr(sys, "argv", ["search", "band1", "--params", str(DEFAULTS)])
    monkeypatch.chdir(tmp_path)
    return tmp_path / "reports/validation/physx-band1.json"


def test_launches_that_fail_leave_the_search_and_the_other_launches(searched, monkeypatch):
    written = []

    def fails() -> None:
        written.append(json.loads(searched.read_text()))
        raise UserError("PhysX: it fell over")

    monkeypatch.setattr(search, "Engine", fails)
    search.main()
    assert "launches" not in written[0] or written[0]["launches"]["failed_engines"] == {}
    content = json.loads(searched.read_text())
    assert content[PHYSX]["theta"]["youngs_modulus"] == THETAS[1, 0]
    assert set(content["launches"]["failed_engines"].values()) == {"PhysX: it fell over"}
    for row, alone in zip(
        content["launches"]["draws"], content["launches_in_our_simulator"], strict=True
    ):
        assert row["draw_m"] == alone["draw_m"] and set(row) == {"draw_m", "in_ours_by_theta_of"}
        for name in (OURS, PHYSX):  # but for the arm, which gives way in the other list
            landing = row["in_ours_by_theta_of"][name]["landing_m"]
            assert landing == pytest.approx(alone["landing_by_theta_of_m"][name], rel=0.02)


def test_what_physx_lands_stands_with_its_theta_and_draw(searched, monkeypatch):
    def thrown(engine, sling, setup, thetas, draws, *, rate):
        assert setup.arm_stiffness is None
        done = search.launch(sling, setup, Parameters.of(sling.law, thetas), draws)
        where = thetas[:, 0] + draws[:, 0] + rate
        fields = {**vars(done), "landing_y": where, "failure": [None] * len(where)}
        return SimpleNamespace(
            launches=SimpleNamespace(**fields), gained=np.full(len(where), np.nan)
        )

    monkeypatch.setattr(search, "Engine", nullcontext)
    monkeypatch.setattr(search, "launch_in_physx", thrown)
    search.main()
    content = json.loads(searched.read_text())["launches"]
    assert content["failed_engines"] == {} and len(content["draws"]) == 3
    for row in content["draws"]:
        for name, rate in (("in_physx", 200), ("in_physx_1000_hz", 1000)):
            for theta, key in zip(THETAS, (OURS, PHYSX), strict=True):
                done = row[f"{name}_by_theta_of"][key]
                assert done["landing_m"] == pytest.approx(theta[0] + row["draw_m"][0] + rate)
                assert done["energy_gained"] is None and done["failure"] is None


def test_measured_landings_stand_beside_their_draws(searched, monkeypatch, tmp_path):
    def none(*_, **__):
        raise UserError("PhysX: it fell over")

    monkeypatch.setattr(search, "Engine", none)
    table = tmp_path / "landings.csv"
    table.write_text("draw_y_m,draw_z_m,landing_y_m\n-0.30,-0.17,2.2\n-0.32,-0.20,3.1\n")
    monkeypatch.setattr(sys, "argv", [*sys.argv, "--landings", str(table)])
    search.main()
    content = json.loads(searched.read_text())
    assert content["command"].endswith("search band1 --landings CSV")
    for rows in (content["launches"]["draws"], content["launches_in_our_simulator"]):
        summary = [(*row["draw_m"], row["measured_m"]) for row in rows]
        assert summary == [(-0.30, -0.17, 2.2), (-0.32, -0.20, 3.1)]
